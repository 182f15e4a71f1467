#pragma once

#include <string>
#include <vector>

#include "rotation.hpp"

/// Text for people.
namespace compare {

/// A number through printf's format.
[[nodiscard]] std::string digits(const char* format, double value);

/// "3.41 [3.30, 3.62]".
[[nodiscard]] std::string text_of(const Summary& summary);

/// Prints rows of cells, the first column to the left, the others to the right; the first row and
/// the rule below it are the head.
void print_table(const std::vector<std::vector<std::string>>& rows);

}  // namespace compare
