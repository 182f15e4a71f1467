# What the hygiene scripts share. Each is run by `cmake -P` with SOURCE_DIR, WORK_DIR (its own),
# COMPILER (the one the build uses) and GLM_INCLUDE_DIR.
cmake_minimum_required(VERSION 3.25)

file(REMOVE_RECURSE ${WORK_DIR})
file(MAKE_DIRECTORY ${WORK_DIR})

set(strict_flags -std=c++20 -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror
    -I${SOURCE_DIR}/include)
# Naming a directory that the compiler searches anyway would change the order of the search.
if(GLM_INCLUDE_DIR AND NOT GLM_INCLUDE_DIR STREQUAL "/usr/include")
    list(APPEND strict_flags -isystem ${GLM_INCLUDE_DIR})
endif()

file(GLOB_RECURSE headers RELATIVE ${SOURCE_DIR}/include ${SOURCE_DIR}/include/nook/*.hpp)
if(NOT headers)
    message(FATAL_ERROR "no headers in ${SOURCE_DIR}/include/nook")
endif()

# Runs a command and reports it with its output when it fails.
function(check_command)
    execute_process(COMMAND ${ARGV} RESULT_VARIABLE status OUTPUT_VARIABLE output
        ERROR_VARIABLE output)
    if(NOT status EQUAL 0)
        list(JOIN ARGV " " line)
        # CMake breaks the lines of a message unless they are indented.
        string(REPLACE "\n" "\n  " output "\n${line}\n${output}")
        message(SEND_ERROR "${output}")
    endif()
endfunction()
