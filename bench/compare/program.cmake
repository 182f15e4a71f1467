# nook_add_comparison(program [libraries...]): a program that compares nook with its peers, from the
# sources of the current folder and of bench/compare. kernels.cpp is compiled once per instruction set;
# the rest of the program asks the CPU which of them to run. NOOK_COMPARE_X86 tells that there are
# several.

include(CheckCXXCompilerFlag)
find_package(nlohmann_json REQUIRED)

# The same optimisation for all contenders, whatever the build type.
if(CMAKE_CXX_COMPILER_ID MATCHES "GNU|Clang")
    set(nook_compare_optimised -O3)
endif()

# Scenes, built-in or read from files; without the examples, their sources alone.
if(NOT TARGET nook-examples AND NOT TARGET nook-scenes)
    find_package(tinyobjloader REQUIRED)
    file(GLOB sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/examples/scenes/*.cpp)
    add_library(nook-scenes STATIC ${sources}
        ${PROJECT_SOURCE_DIR}/examples/support/files.cpp
        ${PROJECT_SOURCE_DIR}/examples/support/obj_file.cpp)
    target_link_libraries(nook-scenes PUBLIC nook-strict tinyobjloader::tinyobjloader)
    target_include_directories(nook-scenes PUBLIC ${PROJECT_SOURCE_DIR}/examples)
endif()

function(nook_add_comparison_kernels program table name)
    add_library(${program}-${table} OBJECT kernels.cpp)
    target_link_libraries(${program}-${table} PRIVATE nook-strict ${NOOK_COMPARE_LIBRARIES})
    target_include_directories(${program}-${table} PRIVATE ${PROJECT_SOURCE_DIR}/bench)
    target_compile_options(${program}-${table} PRIVATE ${nook_compare_optimised} ${ARGN})
    target_compile_definitions(${program}-${table} PRIVATE
        NOOK_TARGET=target_compare_${table}
        NOOK_COMPARE_TABLE=kernels_${table}
        NOOK_COMPARE_NAME="${name}")
    target_link_libraries(${program} PRIVATE ${program}-${table})
endfunction()

function(nook_add_comparison program)
    set(NOOK_COMPARE_LIBRARIES ${ARGN})
    file(GLOB sources CONFIGURE_DEPENDS *.cpp ${PROJECT_SOURCE_DIR}/bench/compare/*.cpp)
    list(REMOVE_ITEM sources ${CMAKE_CURRENT_SOURCE_DIR}/kernels.cpp)
    add_executable(${program} ${sources})
    if(TARGET nook-examples)
        target_link_libraries(${program} PRIVATE nook-examples)
    else()
        target_link_libraries(${program} PRIVATE nook-scenes)
    endif()
    target_link_libraries(${program} PRIVATE
        nook-strict ${NOOK_COMPARE_LIBRARIES} nlohmann_json::nlohmann_json)
    target_include_directories(${program} PRIVATE ${PROJECT_SOURCE_DIR}/bench)
    target_compile_options(${program} PRIVATE ${nook_compare_optimised})
    set_target_properties(${program} PROPERTIES
        RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bench)
    if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64)$")
        check_cxx_compiler_flag(-march=x86-64-v4 NOOK_HAS_X86_64_V4)
    endif()
    if(NOOK_HAS_X86_64_V4)
        nook_add_comparison_kernels(${program} sse2 SSE2 -march=x86-64)
        nook_add_comparison_kernels(${program} avx2 AVX2 -march=x86-64-v3)
        nook_add_comparison_kernels(${program} avx512 AVX-512 -march=x86-64-v4)
        target_compile_definitions(${program} PRIVATE NOOK_COMPARE_X86)
    else()
        nook_add_comparison_kernels(${program} own "this build's own")
    endif()
endfunction()
