#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <nook/image.hpp>

#include "rgb.hpp"

namespace support {

/// An 8-bit RGB picture, sRGB, top row first.
class Picture {
public:
    Picture() = default;
    /// Filled with one colour, stored values.
    Picture(int width, int height, const Rgb& fill = {1, 1, 1});

    [[nodiscard]] int width() const { return width_; }
    [[nodiscard]] int height() const { return height_; }
    [[nodiscard]] const std::vector<std::uint8_t>& bytes() const { return bytes_; }

    /// Stores a colour of stored values in [0, 1], rounded and clamped; a NaN becomes 0. Outside the
    /// picture nothing happens.
    void set(int x, int y, const Rgb& colour);
    [[nodiscard]] Rgb get(int x, int y) const;
    void fill(int x, int y, int width, int height, const Rgb& colour);
    /// Copies `other` to (x, y), cut at the edges.
    void paste(const Picture& other, int x, int y);

private:
    int width_ = 0, height_ = 0;
    std::vector<std::uint8_t> bytes_;
};

/// Linear light to the stored value of sRGB.
[[nodiscard]] float srgb(float linear);
[[nodiscard]] Rgb srgb(const Rgb& linear);

/// Draws a line of ASCII text with its top left corner at (x, y); a letter is about 7 · scale pixels
/// high.
void draw_text(Picture& picture, int x, int y, std::string_view text, int scale = 2,
               const Rgb& colour = {0, 0, 0});
[[nodiscard]] int text_width(std::string_view text, int scale = 2);
[[nodiscard]] constexpr int text_height(int scale = 2) { return 8 * scale; }

/// The picture at half its size, each pixel the mean of four; at least 1 × 1.
[[nodiscard]] Picture halved(const Picture& picture);

/// Pictures side by side with a caption above each.
[[nodiscard]] Picture strip(const std::vector<Picture>& pictures,
                            const std::vector<std::string>& captions);

/// Writes a PNG file, with one channel if the picture is grey; throws Failure.
void write_png(const std::filesystem::path& path, const Picture& picture);

/// Writes a JPEG file for quick looks: off by a few steps of 255. Throws Failure.
void write_jpeg(const std::filesystem::path& path, const Picture& picture);

/// Writes a portable float map, one channel: bottom row first, little-endian. Throws Failure.
void write_pfm(const std::filesystem::path& path, const nook::ImageView<const float>& image);

}  // namespace support
