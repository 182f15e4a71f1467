#include "picture.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#define STBI_WRITE_NO_STDIO
#if __has_include(<stb/stb_image_write.h>)
#include <stb/stb_easy_font.h>
#include <stb/stb_image_write.h>
#else
#include <stb_easy_font.h>
#include <stb_image_write.h>
#endif

#include "failure.hpp"
#include "files.hpp"

namespace support {

namespace {

std::uint8_t stored(float value)
{
    // The comparison is false for NaN.
    if (!(value > 0)) return 0;
    return static_cast<std::uint8_t>(std::lround((std::min)(value, 1.0f) * 255));
}

/// For the functions of stb: adds to a std::string.
void append(void* context, void* data, int size)
{
    static_cast<std::string*>(context)->append(static_cast<const char*>(data),
                                               static_cast<std::size_t>(size));
}

/// One channel of a grey picture, three of any other.
struct Channels {
    int count = 1;
    std::vector<std::uint8_t> bytes;

    explicit Channels(const Picture& picture)
    {
        const std::vector<std::uint8_t>& all = picture.bytes();
        for (std::size_t i = 0; i < all.size(); i += 3) {
            if (all[i] != all[i + 1] || all[i] != all[i + 2]) {
                count = 3;
                bytes = all;
                return;
            }
            bytes.push_back(all[i]);
        }
    }
};

}  // namespace

Picture::Picture(int width, int height, const Rgb& colour)
    : width_{width},
      height_{height},
      bytes_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3)
{
    fill(0, 0, width, height, colour);
}

void Picture::set(int x, int y, const Rgb& colour)
{
    if (x < 0 || y < 0 || x >= width_ || y >= height_) return;
    const auto at = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                         static_cast<std::size_t>(x));
    bytes_[at] = stored(colour.r);
    bytes_[at + 1] = stored(colour.g);
    bytes_[at + 2] = stored(colour.b);
}

Rgb Picture::get(int x, int y) const
{
    const auto at = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                         static_cast<std::size_t>(x));
    return Rgb{float(bytes_[at]), float(bytes_[at + 1]), float(bytes_[at + 2])} * (1 / 255.0f);
}

void Picture::fill(int x, int y, int width, int height, const Rgb& colour)
{
    for (int j = (std::max)(y, 0); j < (std::min)(y + height, height_); ++j)
        for (int i = (std::max)(x, 0); i < (std::min)(x + width, width_); ++i) set(i, j, colour);
}

void Picture::paste(const Picture& other, int x, int y)
{
    for (int j = 0; j < other.height(); ++j)
        for (int i = 0; i < other.width(); ++i) set(x + i, y + j, other.get(i, j));
}

float srgb(float linear)
{
    if (!(linear > 0)) return 0;
    if (linear <= 0.0031308f) return 12.92f * linear;
    return 1.055f * std::pow((std::min)(linear, 1.0f), 1 / 2.4f) - 0.055f;
}

Rgb srgb(const Rgb& linear) { return {srgb(linear.r), srgb(linear.g), srgb(linear.b)}; }

void draw_text(Picture& picture, int x, int y, std::string_view text, int scale, const Rgb& colour)
{
    // stb_easy_font gives quads of four vertices, each of x, y, z and a colour, 16 bytes long.
    std::string line{text};
    std::vector<float> quads(text.size() * 80 + 64);
    const int count = stb_easy_font_print(0, 0, line.data(), nullptr, quads.data(),
                                          static_cast<int>(quads.size() * sizeof(float)));
    for (int quad = 0; quad < count; ++quad) {
        const float* first = quads.data() + quad * 16;
        const float* opposite = first + 8;
        const auto pixel = [&](float at) { return static_cast<int>(std::lround(at)) * scale; };
        picture.fill(x + pixel(first[0]), y + pixel(first[1]), pixel(opposite[0] - first[0]),
                     pixel(opposite[1] - first[1]), colour);
    }
}

int text_width(std::string_view text, int scale)
{
    std::string line{text};
    return stb_easy_font_width(line.data()) * scale;
}

Picture halved(const Picture& picture)
{
    Picture result{(std::max)(picture.width() / 2, 1), (std::max)(picture.height() / 2, 1)};
    for (int y = 0; y < result.height(); ++y)
        for (int x = 0; x < result.width(); ++x) {
            Rgb sum;
            for (int i = 0; i < 4; ++i)
                sum = sum + picture.get((std::min)(2 * x + i % 2, picture.width() - 1),
                                        (std::min)(2 * y + i / 2, picture.height() - 1));
            result.set(x, y, sum * 0.25f);
        }
    return result;
}

Picture strip(const std::vector<Picture>& pictures, const std::vector<std::string>& captions)
{
    constexpr int gap = 8, scale = 2;
    const int top = text_height(scale) + 2 * gap;
    int width = gap, height = 0;
    for (const Picture& picture : pictures) {
        width += picture.width() + gap;
        height = (std::max)(height, picture.height());
    }
    // Grey, so that white pictures show where they end.
    Picture result{width, top + height + gap, {0.85f, 0.85f, 0.85f}};
    int x = gap;
    for (std::size_t i = 0; i < pictures.size(); ++i) {
        draw_text(result, x, gap, captions[i], scale);
        result.paste(pictures[i], x, top);
        x += pictures[i].width() + gap;
    }
    return result;
}

void write_png(const std::filesystem::path& path, const Picture& picture)
{
    const Channels channels{picture};
    std::string bytes;
    if (stbi_write_png_to_func(append, &bytes, picture.width(), picture.height(), channels.count,
                               channels.bytes.data(), picture.width() * channels.count) == 0)
        throw Failure{path.string() + ": cannot be encoded as PNG"};
    write_file(path, bytes);
}

void write_jpeg(const std::filesystem::path& path, const Picture& picture)
{
    constexpr int quality = 85;
    const Channels channels{picture};
    std::string bytes;
    if (stbi_write_jpg_to_func(append, &bytes, picture.width(), picture.height(), channels.count,
                               channels.bytes.data(), quality) == 0)
        throw Failure{path.string() + ": cannot be encoded as JPEG"};
    write_file(path, bytes);
}

void write_pfm(const std::filesystem::path& path, const nook::ImageView<const float>& image)
{
    std::string bytes =
        "Pf\n" + std::to_string(image.width) + ' ' + std::to_string(image.height) + "\n-1.0\n";
    for (int y = image.height - 1; y >= 0; --y)
        for (int x = 0; x < image.width; ++x) {
            const auto bits = std::bit_cast<std::uint32_t>(image(x, y));
            for (int shift = 0; shift < 32; shift += 8)
                bytes.push_back(static_cast<char>(bits >> shift & 0xff));
        }
    write_file(path, bytes);
}

}  // namespace support
