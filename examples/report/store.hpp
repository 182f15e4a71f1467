#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

namespace report {

using Json = nlohmann::ordered_json;

/// What parts of a run have measured, kept in a folder each, so that the same run goes on where it was
/// interrupted. A part is good for the run that made it: for the same program, options and input.
class Store {
public:
    /// `key` tells runs apart; the program itself is told apart by what is in its file.
    Store(std::filesystem::path folder, const Json& key);

    [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
    /// The folder of a part.
    [[nodiscard]] std::filesystem::path folder(const std::string& part) const
    {
        return folder_ / part;
    }
    /// What is kept of a part, an object, if it is good for this run and `input`, which tells its input
    /// apart.
    [[nodiscard]] std::optional<Json> find(const std::string& part, const Json& input) const;
    /// Forgets a part, before what belongs to it is written anew. Throws support::Failure.
    void drop(const std::string& part) const;
    /// Keeps it: all of it or nothing. Throws support::Failure.
    void keep(const std::string& part, const Json& input, const Json& measured) const;

private:
    [[nodiscard]] Json key(const Json& input) const { return {{"run", run_}, {"input", input}}; }

    std::filesystem::path folder_;
    Json run_;
};

/// A number for what is in these bytes (FNV-1a).
[[nodiscard]] std::string digest(const void* bytes, std::size_t size);

}  // namespace report
