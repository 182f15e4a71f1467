#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace report {

using Json = nlohmann::ordered_json;

// Reports and their cells have the shape of docs/report.schema.json.

/// Sets the `pareto` of each result of a cell: the numbers of threads for which no other result of the
/// same meaning is both as fast and as close to the reference, and better in one of the two. Results that
/// are slow or leave rows out take no part.
void mark_pareto(Json& cell);

/// The table for people, of 100 columns: per cell its references and, for each meaning, the results that
/// are on the front with one thread and those of the library's defaults; at the end who wins where.
void print_table(std::ostream& out, const Json& report);

/// One line per cell, result and number of threads, with everything that is a number or a name; RFC 4180.
/// An empty field is null in the report, or does not apply. Numbers come back as they were.
[[nodiscard]] std::string csv_of(const Json& report);

/// The page: one file that needs no other. Pictures are JPEG files ID.jpg in `cells`/CELL/.
[[nodiscard]] std::string page_of(const Json& report, const std::filesystem::path& cells);

}  // namespace report
