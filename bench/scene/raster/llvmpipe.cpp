#include "llvmpipe.hpp"

#if defined(NOOK_COMPARE_EGL)

#include <algorithm>
#include <cmath>

#include <GLES3/gl3.h>

#include <nook/scene/viewpoints.hpp>

#include "compare/failure.hpp"

namespace compare {

namespace {

constexpr const char* head =
    "precision highp float;\n"
    "precision highp int;\n"
    "layout(location = 0) in vec3 position;\n"
    "layout(location = 1) in vec3 vertex_normal;\n"
    "uniform mat4 clip_from_world;\n"
    "uniform mat4x3 view_from_world;\n"
    "uniform mat3 turn;\n";

std::string version_line(bool faces) { return faces ? "#version 320 es\n" : "#version 300 es\n"; }

std::string vertex_source(Target target)
{
    std::string source = version_line(target == Target::faces) + head;
    if (target == Target::facets)
        source +=
            "out vec3 point;\n"
            "void main()\n"
            "{\n"
            "    point = view_from_world * vec4(position, 1);\n";
    else if (target == Target::smooth)
        source +=
            "out vec3 normal;\n"
            "void main()\n"
            "{\n"
            "    normal = turn * vertex_normal;\n";
    else source += "void main()\n{\n";
    return source + "    gl_Position = clip_from_world * vec4(position, 1);\n}\n";
}

std::string fragment_source(Target target)
{
    std::string source = version_line(target == Target::faces) +
                         "precision highp float;\n"
                         "precision highp int;\n";
    switch (target) {
    case Target::facets:
        return source +
               "in vec3 point;\n"
               "layout(location = 0) out vec4 pixel;\n"
               "void main()\n"
               "{\n"
               "    pixel = vec4(normalize(cross(dFdx(point), dFdy(point))), 1);\n"
               "}\n";
    case Target::smooth:
        return source +
               "in vec3 normal;\n"
               "layout(location = 0) out vec4 pixel;\n"
               "void main()\n"
               "{\n"
               "    pixel = vec4(normalize(normal), 1);\n"
               "}\n";
    case Target::faces:
        return source +
               "layout(location = 0) out uint face;\n"
               "void main()\n"
               "{\n"
               "    face = uint(gl_PrimitiveID);\n"
               "}\n";
    default: return source + "void main() {}\n";
    }
}

/// The matrices, by columns, and planes that hold the mesh tightly.
struct Matrices {
    float clip_from_world[16], view_from_world[12], turn[9];

    explicit Matrices(const View& view)
    {
        const nook::ViewFrame& frame = view.frame;
        const nook::Projection& p = view.projection;
        const nook::BoundingSphere sphere = nook::bounding_sphere(view.mesh->view());
        const double depth = -nook::point_to_view(frame, sphere.centre).z;
        const double behind = depth + 1.01 * sphere.radius;
        double front = depth - 1.01 * sphere.radius;
        if (!p.orthographic) front = (std::max)(front, 1e-3 * behind);
        // Rows of view space to clip space.
        const double x = 2 * p.fx / view.width, y = 2 * p.fy / view.height;
        const double z =
            p.orthographic ? -2 / (behind - front) : -(behind + front) / (behind - front);
        const double w = p.orthographic ? -(behind + front) / (behind - front)
                                        : -2 * behind * front / (behind - front);
        for (int column = 0; column < 4; ++column) {
            glm::dvec3 at{0, 0, 0};
            if (column < 3) {
                glm::dvec3 axis{0, 0, 0};
                axis[column] = 1;
                at = nook::direction_to_view(frame, axis);
            } else {
                at = nook::point_to_view(frame, {0, 0, 0});
            }
            const double one = column == 3 ? 1 : 0;
            const double rows[] = {x * at.x, y * at.y, z * at.z + w * one,
                                   p.orthographic ? one : -at.z};
            for (int row = 0; row < 4; ++row)
                clip_from_world[4 * column + row] = static_cast<float>(rows[row]);
            for (int row = 0; row < 3; ++row) {
                view_from_world[3 * column + row] = static_cast<float>(at[row]);
                if (column < 3) turn[3 * column + row] = static_cast<float>(at[row]);
            }
        }
    }
};

template <class T>
GLuint buffer(GLenum kind, const std::vector<T>& data)
{
    GLuint result = 0;
    glGenBuffers(1, &result);
    glBindBuffer(kind, result);
    glBufferData(kind, static_cast<GLsizeiptr>(data.size() * sizeof(T)), data.data(),
                 GL_STATIC_DRAW);
    return result;
}

void check_errors()
{
    if (glGetError() != GL_NO_ERROR) throw Failure{"llvmpipe: an error of OpenGL"};
}

/// Rows from the top down.
template <class T>
void turn_over(std::vector<T>& pixels, int height)
{
    const std::size_t row = pixels.size() / static_cast<std::size_t>(height);
    for (std::size_t y = 0; y < static_cast<std::size_t>(height) / 2; ++y)
        std::swap_ranges(pixels.begin() + static_cast<std::ptrdiff_t>(y * row),
                         pixels.begin() + static_cast<std::ptrdiff_t>((y + 1) * row),
                         pixels.end() - static_cast<std::ptrdiff_t>((y + 1) * row));
}

}  // namespace

struct LlvmpipeView::Objects {
    int width, height;
    GLsizei indices;
    GLuint array = 0, positions = 0, normals = 0, elements = 0;
    /// By the kind of what they draw; 0: none.
    GLuint programs[4] = {}, frames[4] = {}, colours[4] = {};
    GLuint depth = 0;
    std::vector<std::uint32_t> read;

    /// Where a target stands in these arrays.
    [[nodiscard]] static std::size_t slot(Target target)
    {
        switch (target) {
        case Target::smooth: return 1;
        case Target::depth: return 2;
        case Target::faces: return 3;
        default: return 0;
        }
    }
};

LlvmpipeView::LlvmpipeView(const View& view) : objects_{std::make_unique<Objects>()}
{
    Objects& o = *objects_;
    const meshes::Mesh& mesh = *view.mesh;
    o.width = view.width;
    o.height = view.height;
    o.indices = static_cast<GLsizei>(mesh.indices.size());
    glGenVertexArrays(1, &o.array);
    glBindVertexArray(o.array);
    o.positions = buffer(GL_ARRAY_BUFFER, mesh.positions);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
    glEnableVertexAttribArray(0);
    o.normals = buffer(GL_ARRAY_BUFFER, mesh.normals);
    glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
    glEnableVertexAttribArray(1);
    o.elements = buffer(GL_ELEMENT_ARRAY_BUFFER, mesh.indices);

    glGenRenderbuffers(1, &o.depth);
    glBindRenderbuffer(GL_RENDERBUFFER, o.depth);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT32F, o.width, o.height);
    GLint major = 0, minor = 0;
    glGetIntegerv(GL_MAJOR_VERSION, &major);
    glGetIntegerv(GL_MINOR_VERSION, &minor);
    const Matrices matrices{view};
    for (const Target target : {Target::facets, Target::smooth, Target::depth, Target::faces}) {
        if (target == Target::faces && 10 * major + minor < 32) continue;
        const std::size_t slot = Objects::slot(target);
        const GLuint program = llvmpipe_program(vertex_source(target), fragment_source(target));
        o.programs[slot] = program;
        glUseProgram(program);
        const auto at = [&](const char* name) { return glGetUniformLocation(program, name); };
        glUniformMatrix4fv(at("clip_from_world"), 1, GL_FALSE, matrices.clip_from_world);
        glUniformMatrix4x3fv(at("view_from_world"), 1, GL_FALSE, matrices.view_from_world);
        glUniformMatrix3fv(at("turn"), 1, GL_FALSE, matrices.turn);
        glGenFramebuffers(1, &o.frames[slot]);
        glBindFramebuffer(GL_FRAMEBUFFER, o.frames[slot]);
        glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, o.depth);
        if (target != Target::depth) {
            glGenRenderbuffers(1, &o.colours[slot]);
            glBindRenderbuffer(GL_RENDERBUFFER, o.colours[slot]);
            glRenderbufferStorage(GL_RENDERBUFFER, target == Target::faces ? GL_R32UI : GL_RGBA32F,
                                  o.width, o.height);
            glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                                      o.colours[slot]);
        }
        if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
            throw Failure{"llvmpipe draws no such targets"};
    }
    check_errors();
}

LlvmpipeView::~LlvmpipeView()
{
    const Objects& o = *objects_;
    const GLuint buffers[] = {o.positions, o.normals, o.elements};
    for (const GLuint program : o.programs) glDeleteProgram(program);
    glDeleteFramebuffers(4, o.frames);
    glDeleteRenderbuffers(4, o.colours);
    glDeleteRenderbuffers(1, &o.depth);
    glDeleteVertexArrays(1, &o.array);
    glDeleteBuffers(3, buffers);
}

bool LlvmpipeView::draws(Target target) const
{
    return target != Target::counts && target != Target::facets_interleaved &&
           objects_->programs[Objects::slot(target)] != 0;
}

void LlvmpipeView::draw(Target target) const
{
    const Objects& o = *objects_;
    const std::size_t slot = Objects::slot(target);
    glBindVertexArray(o.array);
    glBindFramebuffer(GL_FRAMEBUFFER, o.frames[slot]);
    glViewport(0, 0, o.width, o.height);
    glDisable(GL_CULL_FACE);
    glDisable(GL_DITHER);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    constexpr GLuint nobody[] = {nook::no_face, 0, 0, 0};
    constexpr GLfloat nothing[] = {0, 0, 0, 0}, endless[] = {1};
    glClearBufferfv(GL_DEPTH, 0, endless);
    if (target == Target::faces) glClearBufferuiv(GL_COLOR, 0, nobody);
    else if (target != Target::depth) glClearBufferfv(GL_COLOR, 0, nothing);
    glUseProgram(o.programs[slot]);
    glDrawElements(GL_TRIANGLES, o.indices, GL_UNSIGNED_INT, nullptr);
    glFinish();
}

void LlvmpipeView::count_faces(std::vector<std::uint32_t>& counts)
{
    const Objects& o = *objects_;
    std::vector<std::uint32_t>& faces = objects_->read;
    faces.resize(static_cast<std::size_t>(o.width) * static_cast<std::size_t>(o.height));
    glReadPixels(0, 0, o.width, o.height, GL_RED_INTEGER, GL_UNSIGNED_INT, faces.data());
    std::fill(counts.begin(), counts.end(), 0u);
    for (const std::uint32_t face : faces)
        if (face < counts.size()) ++counts[face];
}

std::vector<float> LlvmpipeView::read_normals() const
{
    const Objects& o = *objects_;
    std::vector<float> pixels(4 * static_cast<std::size_t>(o.width) *
                              static_cast<std::size_t>(o.height));
    glReadPixels(0, 0, o.width, o.height, GL_RGBA, GL_FLOAT, pixels.data());
    check_errors();
    turn_over(pixels, o.height);
    return pixels;
}

std::vector<std::uint32_t> LlvmpipeView::read_faces() const
{
    const Objects& o = *objects_;
    std::vector<std::uint32_t> pixels(static_cast<std::size_t>(o.width) *
                                      static_cast<std::size_t>(o.height));
    glReadPixels(0, 0, o.width, o.height, GL_RED_INTEGER, GL_UNSIGNED_INT, pixels.data());
    check_errors();
    turn_over(pixels, o.height);
    return pixels;
}

}  // namespace compare

#else

namespace compare {

// Nobody makes one without a version.
struct LlvmpipeView::Objects {};
LlvmpipeView::LlvmpipeView(const View&) {}
LlvmpipeView::~LlvmpipeView() = default;
bool LlvmpipeView::draws(Target) const { return false; }
void LlvmpipeView::draw(Target) const {}
void LlvmpipeView::count_faces(std::vector<std::uint32_t>&) {}
std::vector<float> LlvmpipeView::read_normals() const { return {}; }
std::vector<std::uint32_t> LlvmpipeView::read_faces() const { return {}; }

}  // namespace compare

#endif
