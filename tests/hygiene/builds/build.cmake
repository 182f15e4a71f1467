# Small programs, compiled with FLAGS beside the strict ones: they check the kernels under them and
# fail where they break a promise.
include(${CMAKE_CURRENT_LIST_DIR}/../common.cmake)

separate_arguments(FLAGS UNIX_COMMAND "${FLAGS}")
foreach(name channel depths rays surfaces)
    set(program ${WORK_DIR}/${name})
    check_command(${COMPILER} ${strict_flags} ${FLAGS} ${CMAKE_CURRENT_LIST_DIR}/${name}.cpp -o ${program})
    if(EXISTS ${program})
        check_command(${program})
    endif()
endforeach()
