#include "arguments.hpp"

#include <charconv>
#include <cmath>
#include <string>
#include <system_error>

#include "failure.hpp"

namespace support {

namespace {

[[noreturn]] void fail(const char* option, std::string_view text, const std::string& why)
{
    std::string shown{text.substr(0, 60)};
    for (char& c : shown)
        if (c < ' ' || c > '~') c = '?';
    throw Failure{std::string{option} + ": '" + shown + "' " + why};
}

}  // namespace

PictureSize read_picture_size(const char* option, std::string_view text)
{
    constexpr int largest = 8192;
    PictureSize size;
    const char* const end = text.data() + text.size();
    const auto width = std::from_chars(text.data(), end, size.width);
    const bool cross = width.ec == std::errc{} && width.ptr != end && *width.ptr == 'x';
    const auto height = std::from_chars(cross ? width.ptr + 1 : end, end, size.height);
    if (!cross || height.ec != std::errc{} || height.ptr != end || size.width < 1 ||
        size.height < 1 || size.width > largest || size.height > largest)
        fail(option, text, "is not WIDTHxHEIGHT, each from 1 to " + std::to_string(largest));
    return size;
}

double read_positive(const char* option, std::string_view text)
{
    double value = 0;
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    if (error != std::errc{} || stop != end || !std::isfinite(value) || !(value > 0))
        fail(option, text, "is not a finite number above 0");
    return value;
}

void check_output_file(const char* option, const std::filesystem::path& path)
{
    namespace fs = std::filesystem;
    if (path.empty()) throw Failure{std::string{option} + ": an empty name"};
    std::error_code ignored;
    if (fs::is_directory(path, ignored)) fail(option, path.string(), "is a folder");
    const fs::path folder = path.parent_path();
    if (!folder.empty() && !fs::is_directory(folder, ignored))
        fail(option, path.string(), "is in no folder that exists");
}

}  // namespace support
