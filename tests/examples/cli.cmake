# What scripts that run a program from the outside share. They set PROGRAM, its path, before they
# include this. Works in WORK_DIR, by default a folder named like the script; it is made anew.

cmake_path(GET PROGRAM STEM LAST_ONLY program_name)
cmake_path(GET CMAKE_SCRIPT_MODE_FILE STEM script_name)
set(work ${CMAKE_CURRENT_BINARY_DIR}/${script_name})
if(DEFINED WORK_DIR)
    set(work ${WORK_DIR})
endif()
file(REMOVE_RECURSE ${work})
file(MAKE_DIRECTORY ${work})

# Runs the program; sets status, out and err.
macro(run)
    execute_process(COMMAND ${PROGRAM} ${ARGN} WORKING_DIRECTORY ${work}
        RESULT_VARIABLE status OUTPUT_VARIABLE out ERROR_VARIABLE err)
endmacro()

# Bad input: status 2, one line on stderr that contains `named`, nothing on stdout and on disk.
function(refuse named)
    file(GLOB_RECURSE before LIST_DIRECTORIES true ${work}/*)
    run(${ARGN})
    string(REGEX MATCHALL "\n" newlines "${err}")
    list(LENGTH newlines lines)
    string(FIND "${err}" "${named}" at)
    file(GLOB_RECURSE after LIST_DIRECTORIES true ${work}/*)
    if(NOT status EQUAL 2 OR NOT lines EQUAL 1 OR at EQUAL -1 OR NOT out STREQUAL "" OR
       NOT before STREQUAL after)
        message(SEND_ERROR
            "${program_name} ${ARGN}\nexpected a refusal that names: ${named}\n"
            "status: ${status}\nstdout: ${out}\nstderr: ${err}\nbefore: ${before}\nafter: ${after}")
    endif()
endfunction()
