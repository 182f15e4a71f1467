# nook-egl: EGL and OpenGL ES for programs that draw with Mesa's llvmpipe, and NOOK_COMPARE_EGL; an empty
# target where they are not installed.
if(NOT TARGET nook-egl)
    find_path(NOOK_EGL_INCLUDE_DIR EGL/egl.h)
    find_path(NOOK_GLES_INCLUDE_DIR GLES3/gl3.h)
    find_library(NOOK_EGL_LIBRARY EGL)
    find_library(NOOK_GLES_LIBRARY GLESv2)
    mark_as_advanced(
        NOOK_EGL_INCLUDE_DIR NOOK_GLES_INCLUDE_DIR NOOK_EGL_LIBRARY NOOK_GLES_LIBRARY)
    add_library(nook-egl INTERFACE)
    if(NOOK_EGL_INCLUDE_DIR AND NOOK_GLES_INCLUDE_DIR AND NOOK_EGL_LIBRARY AND NOOK_GLES_LIBRARY)
        target_include_directories(nook-egl SYSTEM INTERFACE
            ${NOOK_EGL_INCLUDE_DIR} ${NOOK_GLES_INCLUDE_DIR})
        target_link_libraries(nook-egl INTERFACE ${NOOK_EGL_LIBRARY} ${NOOK_GLES_LIBRARY})
        target_compile_definitions(nook-egl INTERFACE NOOK_COMPARE_EGL)
    endif()
endif()
