#pragma once

#include <filesystem>
#include <string_view>

namespace support {

// What options of a command line say. All throw Failure with one line that begins with `option`.

/// Pixels of a picture.
struct PictureSize {
    int width = 0, height = 0;
};

/// Reads WIDTHxHEIGHT, each from 1 to 8192.
[[nodiscard]] PictureSize read_picture_size(const char* option, std::string_view text);

/// Reads a finite number above 0.
[[nodiscard]] double read_positive(const char* option, std::string_view text);

/// Refuses the name of a file that could not be written later: empty, a folder, in no folder.
void check_output_file(const char* option, const std::filesystem::path& path);

}  // namespace support
