# The headers compile beside the macros of <windows.h>, with the project's own macros in no other
# spelling than NOOK_….
include(${CMAKE_CURRENT_LIST_DIR}/common.cmake)

# What other libraries provide comes first: their headers are not under test.
set(others)
foreach(header IN LISTS headers)
    file(STRINGS ${SOURCE_DIR}/include/${header} lines REGEX "^#include <")
    list(FILTER lines EXCLUDE REGEX "<nook/")
    list(APPEND others ${lines})
    file(STRINGS ${SOURCE_DIR}/include/${header} lines REGEX "^ *# *define")
    list(FILTER lines EXCLUDE REGEX "define NOOK_")
    foreach(line IN LISTS lines)
        message(SEND_ERROR "${header}: ${line}")
    endforeach()
endforeach()
list(REMOVE_DUPLICATES others)
list(JOIN others "\n" others)
list(TRANSFORM headers REPLACE "(.+)" "#include <\\1>")
list(JOIN headers "\n" includes)
file(WRITE ${WORK_DIR}/macros.cpp "${others}
#define near
#define far
#define small char
#define min(a, b) (((a) < (b)) ? (a) : (b))
#define max(a, b) (((a) > (b)) ? (a) : (b))
#define IN
#define OUT
#define ERROR 0
#define CONST const
#define OPAQUE 2
#define TRANSPARENT 1
#define interface struct
${includes}
")
check_command(${COMPILER} ${strict_flags} -fsyntax-only ${WORK_DIR}/macros.cpp)
