# The C++ in README.md is the marked region of examples/drop_in/main.cpp, which the build compiles,
# and what README.md says it prints is what it prints.
include(${CMAKE_CURRENT_LIST_DIR}/common.cmake)

file(READ ${SOURCE_DIR}/examples/drop_in/main.cpp program)
string(REGEX MATCH "    // \\[snippet\\]\n(.*)    // \\[snippet\\]\n" region "${program}")
string(REPLACE "\n    " "\n" region "\n${CMAKE_MATCH_1}")
string(SUBSTRING "${region}" 1 -1 region)
set(region "#include <nook/depth/chebyshev_ao.hpp>\n\n${region}")

file(READ ${SOURCE_DIR}/README.md readme)
string(FIND "${readme}" "```cpp\n${region}```" at)
if(region STREQUAL "" OR at EQUAL -1)
    message(SEND_ERROR "README.md does not hold the snippet of examples/drop_in/main.cpp:\n${region}")
endif()
string(REGEX MATCHALL "```cpp" snippets "${readme}")
list(LENGTH snippets count)
if(NOT count EQUAL 1)
    message(SEND_ERROR "README.md holds ${count} C++ snippets, and only one is compiled")
endif()
string(LENGTH "${readme}" size)
if(size GREATER 5120)
    message(SEND_ERROR "README.md has ${size} bytes; 5 KB at most")
endif()

# The program needs nothing but the ground floor, depth/ and stb: it compiles from a copy of them.
file(GLOB ground_floor ${SOURCE_DIR}/include/nook/*.hpp)
list(REMOVE_ITEM ground_floor ${SOURCE_DIR}/include/nook/nook.hpp)
file(COPY ${ground_floor} ${SOURCE_DIR}/include/nook/depth DESTINATION ${WORK_DIR}/copy/nook)
check_command(${COMPILER} -std=c++20 -O1 -I${WORK_DIR}/copy ${SOURCE_DIR}/examples/drop_in/main.cpp
    -o ${WORK_DIR}/drop-in)
execute_process(COMMAND ${WORK_DIR}/drop-in ${WORK_DIR}/drop_in.png
    OUTPUT_VARIABLE output COMMAND_ERROR_IS_FATAL ANY)
string(FIND "${readme}" "```\n${output}```" at)
if(output STREQUAL "" OR at EQUAL -1)
    message(SEND_ERROR "README.md does not show the output of the drop-in: ${output}")
endif()
file(READ ${WORK_DIR}/drop_in.png magic LIMIT 4 HEX)
if(NOT magic STREQUAL "89504e47")
    message(SEND_ERROR "the drop-in wrote no PNG")
endif()
