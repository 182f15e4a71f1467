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

# Commands that run side by side: those of a pipeline do, and these pass nothing on. `start_command`
# collects them; `finish_commands` waits for all and stops the script when one has failed.
set(waiting)
set(waiting_count 0)
macro(finish_commands)
    if(waiting)
        execute_process(${waiting} RESULTS_VARIABLE results ERROR_VARIABLE output)
        list(REMOVE_DUPLICATES results)
        if(NOT results STREQUAL "0")
            list(JOIN waiting " " line)
            string(REPLACE "COMMAND " "\n  " line "${line}")
            string(REPLACE "\n" "\n  " output "${line}\n${output}")
            message(FATAL_ERROR "one of these commands failed:${output}")
        endif()
    endif()
    set(waiting)
    set(waiting_count 0)
endmacro()
macro(start_command)
    list(APPEND waiting COMMAND ${ARGN})
    math(EXPR waiting_count "${waiting_count} + 1")
    if(waiting_count EQUAL 4)
        finish_commands()
    endif()
endmacro()
