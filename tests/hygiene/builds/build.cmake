# One small program, compiled with FLAGS beside the strict ones: it checks the depth kernels under
# them and fails where they break a promise.
include(${CMAKE_CURRENT_LIST_DIR}/../common.cmake)

separate_arguments(FLAGS UNIX_COMMAND "${FLAGS}")
set(program ${WORK_DIR}/program)
check_command(${COMPILER} ${strict_flags} ${FLAGS} ${CMAKE_CURRENT_LIST_DIR}/main.cpp -o ${program})
if(EXISTS ${program})
    check_command(${program})
endif()
