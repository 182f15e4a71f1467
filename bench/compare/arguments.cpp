#include "arguments.hpp"

#include <charconv>
#include <system_error>

#include "failure.hpp"

namespace compare {

bool Arguments::next()
{
    if (++at_ >= argc_) return false;
    word_ = argv_[at_];
    attached_.clear();
    const std::size_t equals = word_.starts_with("--") ? word_.find('=') : std::string::npos;
    has_attached_ = equals != std::string::npos;
    if (has_attached_) {
        attached_ = word_.substr(equals + 1);
        word_.resize(equals);
    }
    return true;
}

std::string Arguments::value()
{
    if (has_attached_) return attached_;
    if (at_ + 1 == argc_) throw Failure{word_ + ": needs a value"};
    return argv_[++at_];
}

int Arguments::count(int least, int largest)
{
    const std::string text = value();
    int result = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), result);
    if (error != std::errc{} || end != text.data() + text.size() || result < least ||
        result > largest)
        throw Failure{word_ + ": '" + text.substr(0, 60) + "' is not a whole number from " +
                      std::to_string(least) + " to " + std::to_string(largest)};
    return result;
}

std::filesystem::path Arguments::file_to_write()
{
    const std::filesystem::path file = value();
    if (file.empty()) throw Failure{word_ + ": an empty name"};
    std::error_code ignored;
    if (std::filesystem::is_directory(file, ignored))
        throw Failure{word_ + ": '" + file.string() + "' is a folder"};
    const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
    if (!std::filesystem::is_directory(folder, ignored))
        throw Failure{word_ + ": '" + folder.string() + "' is not a folder"};
    return file;
}

void Arguments::flag() const
{
    if (has_attached_) throw Failure{word_ + ": takes no value"};
}

void Arguments::unknown() const
{
    throw Failure{"unknown argument '" + word_.substr(0, 60) + "'; see --help"};
}

}  // namespace compare
