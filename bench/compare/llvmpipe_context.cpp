#include "llvmpipe_context.hpp"

#if defined(NOOK_COMPARE_EGL)

// EGL's headers would otherwise include those of the window system.
#define EGL_NO_X11
#define MESA_EGL_NO_X11_HEADERS

#include <cstdlib>

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GLES3/gl3.h>

#include "failure.hpp"

namespace compare {

namespace {

/// The platforms without a window system, in the words of two extensions.
constexpr EGLenum surfaceless_platform = 0x31DD;

/// Makes a context without a surface current, for good. Returns the name of its renderer, or nothing.
std::string make_context()
{
    // Before Mesa loads its drivers: this one, on the calling thread, nothing written to disk.
    setenv("LIBGL_ALWAYS_SOFTWARE", "1", 1);
    setenv("GALLIUM_DRIVER", "llvmpipe", 1);
    setenv("LP_NUM_THREADS", "0", 1);
    setenv("MESA_SHADER_CACHE_DISABLE", "true", 1);
    const auto get_display = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(
        eglGetProcAddress("eglGetPlatformDisplayEXT"));
    if (get_display == nullptr) return {};
    const EGLDisplay display = get_display(surfaceless_platform, EGL_DEFAULT_DISPLAY, nullptr);
    if (display == EGL_NO_DISPLAY || !eglInitialize(display, nullptr, nullptr)) return {};
    const EGLint wanted[] = {EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_ES3_BIT,
                             EGL_NONE};
    const EGLint version[] = {EGL_CONTEXT_CLIENT_VERSION, 3, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (!eglBindAPI(EGL_OPENGL_ES_API) || !eglChooseConfig(display, wanted, &config, 1, &count) ||
        count < 1)
        return {};
    const EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, version);
    if (context == EGL_NO_CONTEXT ||
        !eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context))
        return {};
    const auto text = [](GLenum what) -> std::string {
        const GLubyte* const bytes = glGetString(what);
        return bytes != nullptr ? reinterpret_cast<const char*>(bytes) : "";
    };
    const std::string renderer = text(GL_RENDERER);
    // Another renderer is another comparison; so is one without float targets.
    if (renderer.find("llvmpipe") == std::string::npos ||
        text(GL_EXTENSIONS).find("GL_EXT_color_buffer_float") == std::string::npos)
        return {};
    return renderer + ", " + text(GL_VERSION);
}

GLuint compiled(GLenum kind, const std::string& source)
{
    const GLuint result = glCreateShader(kind);
    const char* const text = source.c_str();
    glShaderSource(result, 1, &text, nullptr);
    glCompileShader(result);
    GLint fine = 0;
    glGetShaderiv(result, GL_COMPILE_STATUS, &fine);
    if (fine) return result;
    char why[512] = "";
    glGetShaderInfoLog(result, sizeof why, nullptr, why);
    throw Failure{std::string{"llvmpipe compiles no shader: "} + why};
}

}  // namespace

const std::string& llvmpipe_version()
{
    static const std::string version = make_context();
    return version;
}

unsigned llvmpipe_program(const std::string& vertex_source, const std::string& fragment_source)
{
    const GLuint program = glCreateProgram();
    const GLuint vertex = compiled(GL_VERTEX_SHADER, vertex_source);
    const GLuint fragment = compiled(GL_FRAGMENT_SHADER, fragment_source);
    glAttachShader(program, vertex);
    glAttachShader(program, fragment);
    glLinkProgram(program);
    glDeleteShader(vertex);
    glDeleteShader(fragment);
    GLint fine = 0;
    glGetProgramiv(program, GL_LINK_STATUS, &fine);
    if (!fine) throw Failure{"llvmpipe links no program"};
    return program;
}

}  // namespace compare

#else

namespace compare {

const std::string& llvmpipe_version()
{
    static const std::string none;
    return none;
}

// Nobody asks for one without a version.
unsigned llvmpipe_program(const std::string&, const std::string&) { return 0; }

}  // namespace compare

#endif
