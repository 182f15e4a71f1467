#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <nook/checks.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/outline_options.hpp>
#include <nook/scene/outline_view.hpp>

/// Shells as bytes. Everything is little-endian, whatever the machine:
///
/// | offset | bytes | content                                                                      |
/// |--------|-------|------------------------------------------------------------------------------|
/// | 0      | 8     | "nookshel"                                                                   |
/// | 8      | 4     | version, 1                                                                   |
/// | 12     | 4     | 0                                                                            |
/// | 16     | 8     | vertices v                                                                   |
/// | 24     | 8     | triangles t                                                                  |
/// | 32     | 8     | objects o                                                                    |
/// | 40     | 8     | checksum of the 4-byte words before and after it                             |
/// | 48     | 8     | least distance of a face at extent 1, double                                 |
/// | 56     | 12 v  | base, floats                                                                 |
/// |        | 12 v  | direction, floats                                                            |
/// |        | 12 t  | indices                                                                      |
/// |        | 12 o  | objects: first triangle, number of triangles, 1 for open + 2 for inward      |
namespace nook::inline NOOK_TARGET::detail {

struct ShellCounts {
    std::uint64_t vertices, triangles, objects;
    /// See OutlineShell::face_offset.
    double face_offset;

    [[nodiscard]] std::uint64_t size() const;
};

/// The arrays of a shell, to be read or filled.
struct ShellArrays {
    float *base, *direction;
    std::uint32_t* indices;
    OutlineObject* objects;
};

inline constexpr std::size_t shell_header_size = 56, shell_checksum_at = 40;
inline constexpr unsigned char shell_magic[8] = {'n', 'o', 'o', 'k', 's', 'h', 'e', 'l'};
inline constexpr std::uint32_t shell_version = 1;

inline std::uint64_t ShellCounts::size() const
{
    return shell_header_size + 12 * (2 * vertices + triangles + objects);
}

NOOK_INLINE void put_word(unsigned char*& at, std::uint32_t word)
{
    for (unsigned i = 0; i < 4; ++i) *at++ = static_cast<unsigned char>(word >> 8 * i);
}
[[nodiscard]] NOOK_INLINE std::uint32_t get_word(const unsigned char* at)
{
    return std::uint32_t{at[0]} | std::uint32_t{at[1]} << 8 | std::uint32_t{at[2]} << 16 |
           std::uint32_t{at[3]} << 24;
}
[[nodiscard]] inline std::uint64_t get_long(const unsigned char* at)
{
    return get_word(at) | std::uint64_t{get_word(at + 4)} << 32;
}

/// Each step is one to one, so a changed word always shows.
[[nodiscard]] inline std::uint64_t shell_checksum(const unsigned char* data, std::size_t size)
{
    std::uint64_t sum = 0xcbf29ce484222325u;
    for (std::size_t at = 0; at < size; at += 4) {
        if (at == shell_checksum_at) at += 8;
        sum = std::rotl((sum ^ get_word(data + at)) * 0x9e3779b97f4a7c15u, 27);
    }
    return sum;
}

/// Writes `counts.size()` bytes.
inline void write_shell(const ShellCounts& counts, const OutlineView& view,
                        const OutlineObject* objects, void* data)
{
    auto* const begin = static_cast<unsigned char*>(data);
    std::memcpy(begin, shell_magic, sizeof shell_magic);
    unsigned char* at = begin + sizeof shell_magic;
    put_word(at, shell_version);
    put_word(at, 0);
    const auto put_long = [&](std::uint64_t value) {
        put_word(at, static_cast<std::uint32_t>(value));
        put_word(at, static_cast<std::uint32_t>(value >> 32));
    };
    put_long(counts.vertices);
    put_long(counts.triangles);
    put_long(counts.objects);
    unsigned char* const checksum = at;
    put_long(0);
    put_long(std::bit_cast<std::uint64_t>(counts.face_offset));
    for (const float* const floats : {view.base, view.direction})
        for (std::size_t i = 0; i < 3 * view.vertex_count; ++i)
            put_word(at, std::bit_cast<std::uint32_t>(floats[i]));
    for (std::size_t i = 0; i < 3 * view.triangle_count; ++i) put_word(at, view.indices[i]);
    for (std::size_t i = 0; i < counts.objects; ++i) {
        put_word(at, objects[i].first_triangle);
        put_word(at, objects[i].triangle_count);
        put_word(at, (objects[i].open ? 1u : 0u) | (objects[i].inward ? 2u : 0u));
    }
    const auto size = static_cast<std::size_t>(at - begin);
    at = checksum;
    put_long(shell_checksum(begin, size));
}

/// Checks everything of the bytes but what only `read_shell` sees.
[[nodiscard]] inline Error check_shell(const void* data, std::size_t size, ShellCounts& counts)
{
    if (data == nullptr && size > 0) return {ErrorCode::null_data, "data", 0, "what was saved"};
    if (size < shell_header_size)
        return {ErrorCode::bad_size, "size", double(size), "all that was saved"};
    const auto* const bytes = static_cast<const unsigned char*>(data);
    if (std::memcmp(bytes, shell_magic, sizeof shell_magic) != 0)
        return {ErrorCode::bad_value, "data.magic", double(bytes[0]), "a saved shell"};
    if (get_long(bytes + 8) != shell_version)
        return {ErrorCode::bad_value, "data.version", double(get_word(bytes + 8)), "1"};
    counts = {get_long(bytes + 16), get_long(bytes + 24), get_long(bytes + 32),
              std::bit_cast<double>(get_long(bytes + 48))};
    const struct {
        const char* name;
        std::uint64_t value;
    } limited[] = {{"data.vertex_count", counts.vertices},
                   {"data.triangle_count", counts.triangles},
                   {"data.object_count", counts.objects}};
    for (const auto& [name, value] : limited)
        if (value > 0x7fffffff)
            return {ErrorCode::bad_size, name, double(value), "at most 2^31 - 1"};
    if (counts.size() != size)
        return {ErrorCode::bad_size, "size", double(size), "the size that the data tell"};
    if (shell_checksum(bytes, size) != get_long(bytes + shell_checksum_at))
        return {ErrorCode::bad_value, "data.checksum", 0, "bytes as they were saved"};
    if (is_nan(counts.face_offset))
        return {ErrorCode::bad_value, "data.face_offset", counts.face_offset, "a number"};
    return {};
}

/// Reads bytes that passed `check_shell`. Whether floats are finite, indices name a vertex, and objects
/// follow one another: a checksum can be made up.
[[nodiscard]] inline Error read_shell(const ShellCounts& counts, const void* data,
                                      const ShellArrays& arrays)
{
    const auto* at = static_cast<const unsigned char*>(data) + shell_header_size;
    const auto take = [&] {
        const std::uint32_t word = get_word(at);
        at += 4;
        return word;
    };
    const struct {
        const char* name;
        float* floats;
    } vectors[] = {{"data.base", arrays.base}, {"data.direction", arrays.direction}};
    for (const auto& [name, floats] : vectors)
        for (std::size_t i = 0; i < 3 * counts.vertices; ++i) {
            floats[i] = std::bit_cast<float>(take());
            if (!is_finite(floats[i]))
                return {ErrorCode::bad_value, name, double(i), "finite floats: this one is not"};
        }
    for (std::size_t i = 0; i < 3 * counts.triangles; ++i) {
        arrays.indices[i] = take();
        if (arrays.indices[i] >= counts.vertices)
            return {ErrorCode::index_out_of_range, "data.indices", double(arrays.indices[i]),
                    "indices below the vertex count"};
    }
    std::uint64_t next = 0;
    for (std::size_t i = 0; i < counts.objects; ++i) {
        OutlineObject& object = arrays.objects[i];
        object.first_triangle = take();
        object.triangle_count = take();
        const std::uint32_t flags = take();
        object.open = (flags & 1) != 0;
        object.inward = (flags & 2) != 0;
        if (object.first_triangle != next || flags > 3)
            return {ErrorCode::bad_value, "data.objects", double(i), "objects side by side"};
        next += object.triangle_count;
    }
    if (next != counts.triangles)
        return {ErrorCode::bad_value, "data.objects", double(next), "all triangles in objects"};
    return {};
}

}  // namespace nook::inline NOOK_TARGET::detail
