# Each header compiles alone, without warnings, without exceptions, without RTTI and with the most
# liberal arithmetic.
include(${CMAKE_CURRENT_LIST_DIR}/common.cmake)

foreach(header IN LISTS headers)
    check_command(${COMPILER} ${strict_flags} -fno-exceptions -fno-rtti -ffast-math -fsyntax-only
        -include ${header} -x c++ /dev/null)
endforeach()
