#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "common_options.hpp"
#include "marks.hpp"
#include "rotation.hpp"

/// Results for programs.
namespace compare {

using Json = nlohmann::ordered_json;

/// What the numbers hang on: nook's version, the CPU, the compiler, the instruction set that was
/// measured, the peer and its version (empty: not found), and how the program was called.
[[nodiscard]] Json json_of_machine(const char* instruction_set, const char* peer,
                                   const std::string& peer_version, const CommonOptions& options);
[[nodiscard]] Json json_of(const Summary& summary);
[[nodiscard]] Json json_of(const std::vector<Mark>& marks);
[[nodiscard]] Json json_of(const std::vector<Fact>& facts);

/// Prints the entries of `json_of_machine`, a line each, and by which clock times are.
void print_machine(const Json& machine);

/// Throws Failure.
void write_json(const Json& json, const std::filesystem::path& file);

}  // namespace compare
