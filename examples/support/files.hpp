#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace support {

/// The whole file. Throws Failure when it is missing, cannot be read, holds more than `largest` bytes,
/// or is not a regular file: a folder, a device, a pipe.
[[nodiscard]] std::string read_file(const std::filesystem::path& path,
                                    std::uintmax_t largest = std::uintmax_t{1} << 32);

/// Writes the file under a temporary name beside it and renames it, so that a reader finds the old
/// file or the new one and never half of either. Throws Failure and leaves nothing behind when the
/// disk is full or the folder cannot be written.
void write_file(const std::filesystem::path& path, std::string_view bytes);

/// Makes the folder if it is missing and proves that files can be written to it. Throws Failure.
void prepare_folder(const std::filesystem::path& folder);

}  // namespace support
