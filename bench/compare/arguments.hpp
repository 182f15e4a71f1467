#pragma once

#include <filesystem>
#include <string>

namespace compare {

/// The words of a command line; options are `--name value` or `--name=value`. Every function throws
/// Failure with one line that names the argument.
class Arguments {
public:
    Arguments(int argc, const char* const* argv) : argc_{argc}, argv_{argv} {}

    /// Goes on to the next word; false at the end.
    [[nodiscard]] bool next();
    /// The word, without what an `=` attached to it.
    [[nodiscard]] const std::string& word() const { return word_; }
    [[nodiscard]] bool is_option() const { return word_.starts_with('-'); }

    /// The value of an option.
    [[nodiscard]] std::string value();
    [[nodiscard]] int count(int least, int largest);
    /// Refuses what stands in the way of a file before there are results to lose.
    [[nodiscard]] std::filesystem::path file_to_write();
    /// An option that has no value.
    void flag() const;
    [[noreturn]] void unknown() const;

private:
    int argc_;
    const char* const* argv_;
    int at_ = 0;
    std::string word_{}, attached_{};
    bool has_attached_ = false;
};

}  // namespace compare
