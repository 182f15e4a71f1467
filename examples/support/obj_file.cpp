#include "obj_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <system_error>

#include <tiny_obj_loader.h>

#include <nook/scene/mesh.hpp>

#include "failure.hpp"
#include "files.hpp"

// tinyobjloader repairs what it does not understand: NaN, infinity and words become 0, missing
// coordinates too; a face of two vertices and unknown statements are skipped; indices out of range
// are a warning. So every statement is checked here first, and only clean vertices and faces are
// handed on: it resolves relative indices and cuts polygons into triangles.

namespace support {

namespace {

/// The words of a line, split at blanks.
class Words {
public:
    explicit Words(std::string_view line) : rest_{line} {}

    /// The next word; empty at the end.
    std::string_view next()
    {
        const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
        while (!rest_.empty() && blank(rest_.front())) rest_.remove_prefix(1);
        std::size_t length = 0;
        while (length < rest_.size() && !blank(rest_[length])) ++length;
        const std::string_view word = rest_.substr(0, length);
        rest_.remove_prefix(length);
        return word;
    }

private:
    std::string_view rest_;
};

/// Statements of the format (Wavefront, appendix B) that carry no triangle.
constexpr auto other_statements = std::to_array<std::string_view>(
    {"vt",        "vn",     "vp",     "p",      "l",        "o",        "g",    "s",
     "mg",        "mtllib", "usemtl", "usemap", "maplib",   "cstype",   "deg",  "bmat",
     "step",      "curv",   "curv2",  "surf",   "parm",     "trim",     "hole", "scrv",
     "sp",        "end",    "con",    "bevel",  "c_interp", "d_interp", "lod",  "shadow_obj",
     "trace_obj", "ctech",  "stech",  "call",   "csh",      "vw",       "t"});

/// One word for a message: short and printable.
std::string in_quotes(std::string_view word)
{
    std::string text = "'";
    for (const char c : word.substr(0, 24)) text += c >= ' ' && c <= '~' ? c : '?';
    return text + (word.size() > 24 ? "...'" : "'");
}

/// Reads a coordinate; NaN where it is not finite as a float. False when it is not a number.
bool read_number(std::string_view word, float& value)
{
    if (!word.empty() && word.front() == '+') word.remove_prefix(1);
    double number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error == std::errc::invalid_argument) return false;
    if (error == std::errc::result_out_of_range) {
        // Too large is infinite, too little is 0.
        number = std::strtod(std::string{word}.c_str(), nullptr);
    }
    const std::string_view tail{end, static_cast<std::size_t>(word.data() + word.size() - end)};
    const bool infinity_of_windows = tail.starts_with('#');  // 1.#INF, -1.#IND, 1.#QNAN
    if (!tail.empty() && !infinity_of_windows) return false;
    value = static_cast<float>(number);
    if (infinity_of_windows || !std::isfinite(value))
        value = std::numeric_limits<float>::quiet_NaN();
    return true;
}

class Checker {
public:
    explicit Checker(std::string_view name) : name_{name} {}

    void statement(std::string_view line, std::size_t number)
    {
        line_ = number;
        Words words{line};
        const std::string_view keyword = words.next();
        if (keyword.empty() || keyword.front() == '#') return;
        if (keyword == "v") vertex(words);
        else if (keyword == "f") face(words);
        else if (keyword == "vt") ++textures_;
        else if (keyword == "vn") ++normals_;
        else if (std::find(other_statements.begin(), other_statements.end(), keyword) ==
                 other_statements.end())
            fail(in_quotes(keyword) + " is not an OBJ statement");
    }

    /// Indices may name vertices that come later: known only at the end.
    void finish()
    {
        const auto check = [&](const Largest& largest, std::size_t count, const char* what) {
            if (largest.index <= count) return;
            line_ = largest.line;
            fail(std::string{what} + " index " + std::to_string(largest.index) +
                 " is out of range: there are " + std::to_string(count));
        };
        check(largest_vertex_, vertices(), "vertex");
        check(largest_texture_, textures_, "texture");
        check(largest_normal_, normals_, "normal");
    }

    [[nodiscard]] std::size_t vertices() const { return positions.size() / 3; }

    std::vector<float> positions;
    std::string clean;          // vertices and faces for tinyobjloader
    std::size_t triangles = 0;  // that the faces should make

private:
    struct Largest {
        std::size_t index = 0, line = 0;
    };

    [[noreturn]] void fail(const std::string& why) const
    {
        throw Failure{name_ + ": line " + std::to_string(line_) + ": " + why};
    }

    void vertex(Words& words)
    {
        clean += 'v';
        for (int axis = 0; axis < 3; ++axis) {
            const std::string_view word = words.next();
            if (word.empty()) fail("a vertex with fewer than three coordinates");
            float value = 0;
            if (!read_number(word, value)) fail(in_quotes(word) + " is not a number");
            positions.push_back(value);
            char text[32];
            // A polygon is cut by its shape, which a vertex that is nowhere does not have.
            const float known = std::isfinite(value) ? value : 0;
            const auto end = std::to_chars(text, text + sizeof text, known).ptr;
            clean.append(" ").append(text, end);
        }
        clean += '\n';
        // A fourth number is a weight, three more are a colour.
        for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
            float value = 0;
            if (word.front() == '#') break;
            if (!read_number(word, value)) fail(in_quotes(word) + " is not a number");
        }
    }

    void face(Words& words)
    {
        clean += 'f';
        std::size_t corners = 0;
        for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
            if (word.front() == '#') break;
            corner(word);
            ++corners;
        }
        if (corners < 3) fail("a face with fewer than three vertices");
        triangles += corners - 2;
        clean += '\n';
    }

    /// v, v/vt, v//vn or v/vt/vn.
    void corner(std::string_view word)
    {
        const std::string_view whole = word;
        for (int part = 0; part < 3; ++part) {
            const std::size_t slash = word.find('/');
            const std::string_view digits = word.substr(0, slash);
            if (!digits.empty()) index(digits, part, whole);
            else if (part == 0) fail(in_quotes(whole) + " is not a vertex of a face");
            if (slash == std::string_view::npos) return;
            word.remove_prefix(slash + 1);
        }
        fail(in_quotes(whole) + " is not a vertex of a face");
    }

    void index(std::string_view digits, int part, std::string_view whole)
    {
        long long value = 0;
        const auto [end, error] =
            std::from_chars(digits.data(), digits.data() + digits.size(), value);
        if (error == std::errc::invalid_argument || end != digits.data() + digits.size())
            fail(in_quotes(whole) + " is not a vertex of a face");
        const std::size_t known = part == 0 ? vertices() : part == 1 ? textures_ : normals_;
        if (error != std::errc{} || value == 0 ||
            (value < 0 && std::size_t(-(value + 1)) >= known) ||
            value >= std::numeric_limits<int>::max())
            fail("index " + std::string{digits.substr(0, 24)} + " is out of range");
        Largest& largest = part == 0   ? largest_vertex_
                           : part == 1 ? largest_texture_
                                       : largest_normal_;
        if (value > 0 && std::size_t(value) > largest.index) largest = {std::size_t(value), line_};
        if (part == 0) clean.append(" ").append(digits);
    }

    std::string name_;
    std::size_t line_ = 0;
    std::size_t textures_ = 0, normals_ = 0;
    Largest largest_vertex_, largest_texture_, largest_normal_;
};

/// Calls `each(line, number)`; a backslash at the end of a line joins the next to it.
template <class F>
void for_each_line(const std::string& text, F&& each)
{
    std::size_t number = 0;
    std::string joined;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = (std::min)(text.find_first_of("\r\n", at), text.size());
        std::string_view line{text.data() + at, end - at};
        at = end + 1;
        if (end + 1 < text.size() && text[end] == '\r' && text[end + 1] == '\n') ++at;
        ++number;
        if (line.ends_with('\\')) {
            line.remove_suffix(1);
            joined.append(line).append(" ");
            continue;
        }
        if (!joined.empty()) {
            joined.append(line);
            line = joined;
        }
        each(line, number);
        joined.clear();
    }
    if (!joined.empty()) each(std::string_view{joined}, number);
}

}  // namespace

ObjMesh parse_obj(std::string text, std::string_view name)
{
    if (text.empty()) throw Failure{std::string{name} + ": is empty"};
    Checker checker{name};
    if (text.starts_with("\xef\xbb\xbf")) text.erase(0, 3);
    for_each_line(
        text, [&](std::string_view line, std::size_t number) { checker.statement(line, number); });
    checker.finish();
    if (checker.triangles == 0) throw Failure{std::string{name} + ": holds no face"};
    if (checker.triangles >= nook::no_face || checker.vertices() > 0x7fffffff)
        throw Failure{std::string{name} + ": holds too many faces or vertices"};
    text = {};

    tinyobj::ObjReaderConfig config;
    config.vertex_color = false;
    tinyobj::ObjReader reader;
    if (!reader.ParseFromString(checker.clean, {}, config)) {
        std::string why = reader.Error();
        std::replace(why.begin(), why.end(), '\n', ' ');
        throw Failure{std::string{name} + ": " + why};
    }

    ObjMesh mesh;
    mesh.positions = std::move(checker.positions);
    std::vector<std::uint32_t> indices;
    indices.reserve(3 * checker.triangles);
    for (const tinyobj::shape_t& shape : reader.GetShapes())
        for (const tinyobj::index_t& index : shape.mesh.indices)
            indices.push_back(static_cast<std::uint32_t>(index.vertex_index));

    const nook::MeshView view{mesh.positions.data(), mesh.positions.size() / 3, indices.data(),
                              indices.size() / 3};
    if (nook::check_mesh(view)) throw Failure{std::string{name} + ": indices out of range"};
    for (std::size_t triangle = 0; triangle < view.triangle_count; ++triangle)
        if (nook::is_usable_triangle(view, triangle))
            for (std::size_t corner = 0; corner < 3; ++corner)
                mesh.indices.push_back(indices[3 * triangle + corner]);
    const std::size_t kept = mesh.indices.size() / 3;
    // A polygon without area may give fewer triangles than it has corners for.
    mesh.dropped = (std::max)(checker.triangles, view.triangle_count) - kept;
    if (kept == 0)
        throw Failure{std::string{name} + ": no triangle is left: all " +
                      std::to_string(mesh.dropped) +
                      " have no area or vertices that are not finite"};
    return mesh;
}

ObjMesh read_obj(const std::filesystem::path& path)
{
    return parse_obj(read_file(path), path.string());
}

}  // namespace support
