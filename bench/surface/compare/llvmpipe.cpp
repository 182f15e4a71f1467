#include "llvmpipe.hpp"

#if defined(NOOK_COMPARE_EGL)

#include <numbers>
#include <sstream>
#include <vector>

#include <GLES3/gl3.h>

#include "compare/failure.hpp"
#include "outlines/textbook_ao.hpp"

namespace compare {

namespace {

constexpr const char* vertex_source =
    "#version 300 es\n"
    "void main()\n"
    "{\n"
    "    gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0, 1);\n"
    "}\n";

/// What follows `places()`, which calls `term` for each sample and returns the sum.
constexpr const char* head =
    "#version 300 es\n"
    "precision highp float;\n"
    "precision highp int;\n"
    "precision highp sampler2D;\n"
    "uniform sampler2D depths, normals;\n"
    "uniform vec2 size, focal, per_pixel, centre;\n"
    "uniform float radius, largest_slope, least_slope, bias, epsilon, scale;\n"
    "uniform vec2 rotations[16];\n"
    "out float visibility;\n"
    "vec2 middle, reach, turn;\n"
    "vec3 point, normal;\n"
    "float rise;\n"
    "vec3 point_at(vec2 pixel, float distance)\n"
    "{\n"
    "    vec2 slope = (pixel - centre) * per_pixel;\n"
    "    return vec3(slope.x, -slope.y, -1.0) * distance;\n"
    "}\n"
    "float term(vec2 place)\n"
    "{\n"
    "#ifdef ROTATED\n"
    "    place = vec2(place.x * turn.x - place.y * turn.y, place.x * turn.y + place.y * turn.x);\n"
    "#endif\n"
    "    vec2 to = middle + place * reach;\n"
    "    bool inside = all(greaterThanEqual(to, vec2(0.0))) && all(lessThan(to, size));\n"
    "    ivec2 at = ivec2(to);\n"
    "    float there = texelFetch(depths, at, 0).r;\n"
    "    vec3 v = point_at(vec2(at) + 0.5, there) - point;\n"
    "    float value = max(dot(v, normal) - rise, 0.0) / (dot(v, v) + epsilon);\n"
    "    return inside && there > 0.0 && there < 1e30 ? value : 0.0;\n"
    "}\n";
constexpr const char* tail =
    "void main()\n"
    "{\n"
    "    ivec2 at = ivec2(gl_FragCoord.xy);\n"
    "    float distance = texelFetch(depths, at, 0).r;\n"
    "    visibility = 1.0;\n"
    "    float slope = min(radius / distance, largest_slope);\n"
    "    if (!(distance > 0.0 && distance < 1e30) || slope < least_slope) return;\n"
    "    middle = vec2(at) + 0.5;\n"
    "    reach = slope * focal;\n"
    "    point = point_at(middle, distance);\n"
    "    normal = texelFetch(normals, at, 0).xyz;\n"
    "    rise = bias * distance;\n"
    "#ifdef ROTATED\n"
    "    turn = rotations[ROTATED];\n"
    "#endif\n"
    "    visibility = max(1.0 - scale * places(), 0.0);\n"
    "}\n";

std::string fragment_source(const nook::AlchemyOptions& options, ShaderPattern pattern)
{
    std::ostringstream source;
    source.precision(9);
    source << std::fixed;
    std::string text = head;
    const char* const rotation = pattern == ShaderPattern::row     ? "at.y * 7 & 15"
                                 : pattern == ShaderPattern::pixel ? "(at.x & 3) + 4 * (at.y & 3)"
                                                                   : nullptr;
    if (rotation != nullptr)
        text.insert(text.find('\n') + 1, std::string{"#define ROTATED "} + rotation + '\n');
    outlines::RotationTable table;
    outlines::fill_table(table, options);
    source << text << "float places()\n{\n    float sum = 0.0;\n";
    for (int i = 0; i < options.samples; ++i)
        source << "    sum += term(vec2(" << table.right[0][i] << ", " << table.down[0][i]
               << "));\n";
    source << "    return sum;\n}\n" << tail;
    return source.str();
}

GLuint texture(GLint format, int width, int height, GLenum channels, const float* data)
{
    GLuint result = 0;
    glGenTextures(1, &result);
    glBindTexture(GL_TEXTURE_2D, result);
    glTexImage2D(GL_TEXTURE_2D, 0, format, width, height, 0, channels, GL_FLOAT, data);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return result;
}

}  // namespace

struct ShaderAo::Objects {
    int width, height;
    nook::Projection projection;
    GLuint depths = 0, normals = 0, target = 0, frame = 0;
    std::vector<GLuint> programs;
};

ShaderAo::ShaderAo(const Picture& picture) : objects_{std::make_unique<Objects>()}
{
    Objects& o = *objects_;
    o.width = picture.width();
    o.height = picture.height();
    o.projection = picture.projection;
    std::vector<float> vectors;
    vectors.reserve(4 * picture.pixels());
    const Normals normal = picture.normal();
    for (int y = 0; y < o.height; ++y)
        for (int x = 0; x < o.width; ++x)
            vectors.insert(vectors.end(), {normal.x(x, y), normal.y(x, y), normal.z(x, y), 0.0f});
    o.depths = texture(GL_R32F, o.width, o.height, GL_RED, picture.depth.data());
    o.normals = texture(GL_RGBA32F, o.width, o.height, GL_RGBA, vectors.data());
    o.target = texture(GL_R32F, o.width, o.height, GL_RED, nullptr);
    glGenFramebuffers(1, &o.frame);
    glBindFramebuffer(GL_FRAMEBUFFER, o.frame);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, o.target, 0);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        throw Failure{"llvmpipe draws no floats"};
}

ShaderAo::~ShaderAo()
{
    const Objects& o = *objects_;
    const GLuint textures[] = {o.depths, o.normals, o.target};
    for (const GLuint program : o.programs) glDeleteProgram(program);
    glDeleteFramebuffers(1, &o.frame);
    glDeleteTextures(3, textures);
}

unsigned ShaderAo::compile(const nook::AlchemyOptions& options, ShaderPattern pattern)
{
    const GLuint program = llvmpipe_program(vertex_source, fragment_source(options, pattern));
    objects_->programs.push_back(program);
    const outlines::TextbookNumbers n = outlines::textbook_numbers(options, objects_->projection);
    glUseProgram(program);
    const auto at = [&](const char* name) { return glGetUniformLocation(program, name); };
    glUniform1i(at("depths"), 0);
    glUniform1i(at("normals"), 1);
    glUniform2f(at("size"), static_cast<float>(objects_->width),
                static_cast<float>(objects_->height));
    glUniform2f(at("focal"), n.fx, n.fy);
    glUniform2f(at("per_pixel"), n.per_x, n.per_y);
    glUniform2f(at("centre"), n.cx, n.cy);
    glUniform1f(at("radius"), n.radius);
    glUniform1f(at("largest_slope"), n.largest_slope);
    glUniform1f(at("least_slope"), n.least_slope);
    glUniform1f(at("bias"), n.bias);
    glUniform1f(at("epsilon"), n.epsilon);
    glUniform1f(at("scale"), n.scale);
    for (int k = 0; k < outlines::RotationTable::rotations; ++k) {
        const double angle = 2 * std::numbers::pi * k / outlines::RotationTable::rotations;
        const std::string name = "rotations[" + std::to_string(k) + "]";
        glUniform2f(at(name.c_str()), static_cast<float>(std::cos(angle)),
                    static_cast<float>(std::sin(angle)));
    }
    return program;
}

void ShaderAo::draw(unsigned program) const
{
    const Objects& o = *objects_;
    glBindFramebuffer(GL_FRAMEBUFFER, o.frame);
    glViewport(0, 0, o.width, o.height);
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, o.depths);
    glActiveTexture(GL_TEXTURE1);
    glBindTexture(GL_TEXTURE_2D, o.normals);
    glUseProgram(program);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glFinish();
}

nook::Image<float> ShaderAo::read() const
{
    const Objects& o = *objects_;
    std::vector<float> pixels(4 * static_cast<std::size_t>(o.width) *
                              static_cast<std::size_t>(o.height));
    glReadPixels(0, 0, o.width, o.height, GL_RGBA, GL_FLOAT, pixels.data());
    if (glGetError() != GL_NO_ERROR) throw Failure{"llvmpipe: an error of OpenGL"};
    nook::Image<float> result{o.width, o.height};
    const float* from = pixels.data();
    for (float& value : result) {
        value = *from;
        from += 4;
    }
    return result;
}

}  // namespace compare

#else

namespace compare {

// Nobody makes one without a version.
struct ShaderAo::Objects {};
ShaderAo::ShaderAo(const Picture&) {}
ShaderAo::~ShaderAo() = default;
unsigned ShaderAo::compile(const nook::AlchemyOptions&, ShaderPattern) { return 0; }
void ShaderAo::draw(unsigned) const {}
nook::Image<float> ShaderAo::read() const { return {}; }

}  // namespace compare

#endif
