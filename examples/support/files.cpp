#include "files.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>
#include <system_error>

#include "failure.hpp"

namespace support {

namespace fs = std::filesystem;

namespace {

std::string reason() { return std::strerror(errno); }

/// A name beside `path` that no other run uses.
fs::path temporary_beside(const fs::path& path)
{
    static std::random_device random;
    char tail[16];
    std::snprintf(tail, sizeof tail, ".%08x.tmp", static_cast<unsigned>(random()));
    fs::path result = path;
    result += tail;
    return result;
}

}  // namespace

std::string read_file(const fs::path& path, std::uintmax_t largest)
{
    // What is missing or out of reach is left to the opening, which knows the reason.
    std::error_code ignored;
    const fs::file_status status = fs::status(path, ignored);
    if (fs::is_directory(status)) throw Failure{path.string() + ": is a folder"};
    if (fs::exists(status) && !fs::is_regular_file(status))
        throw Failure{path.string() + ": is not a regular file"};
    const std::uintmax_t size = fs::file_size(path, ignored);
    if (!ignored && size > largest)
        throw Failure{path.string() + ": is larger than " + std::to_string(largest) + " bytes"};
    errno = 0;
    std::ifstream file{path, std::ios::binary};
    if (!file) throw Failure{path.string() + ": cannot be opened: " + reason()};
    std::string bytes{std::istreambuf_iterator<char>{file}, {}};
    if (file.bad()) throw Failure{path.string() + ": cannot be read: " + reason()};
    return bytes;
}

void write_file(const fs::path& path, std::string_view bytes)
{
    const fs::path temporary = temporary_beside(path);
    errno = 0;
    std::FILE* file = std::fopen(temporary.c_str(), "wbx");
    if (file == nullptr) throw Failure{path.string() + ": cannot be written: " + reason()};
    bool written = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
    // A full disk may show only when the buffer is flushed.
    written = std::fflush(file) == 0 && written;
    const std::string why = reason();
    written = std::fclose(file) == 0 && written;
    std::error_code error;
    if (written) fs::rename(temporary, path, error);
    if (!written || error) {
        std::error_code ignored;
        fs::remove(temporary, ignored);
        throw Failure{path.string() + ": cannot be written: " + (error ? error.message() : why)};
    }
}

void prepare_folder(const fs::path& folder)
{
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) throw Failure{folder.string() + ": cannot be made: " + error.message()};
    if (!fs::is_directory(folder, error)) throw Failure{folder.string() + ": is not a folder"};
    const fs::path probe = temporary_beside(folder / "probe");
    errno = 0;
    std::FILE* file = std::fopen(probe.c_str(), "wbx");
    if (file == nullptr)
        throw Failure{folder.string() + ": is not a folder that can be written: " + reason()};
    std::fclose(file);
    fs::remove(probe, error);
}

}  // namespace support
