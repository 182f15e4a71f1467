#include "table.hpp"

#include <algorithm>
#include <cstdio>

namespace compare {

namespace {

/// Characters on screen: all but the later bytes of UTF-8.
std::size_t columns(const std::string& text)
{
    return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
        return (static_cast<unsigned char>(c) & 0xc0) != 0x80;
    }));
}

}  // namespace

std::string digits(const char* format, double value)
{
    char text[64];
    std::snprintf(text, sizeof text, format, value);
    return text;
}

std::string text_of(const Summary& summary)
{
    const auto short_digits = [](double value) {
        return digits(value < 1 ? "%.3f" : "%.2f", value);
    };
    return short_digits(summary.median) + " [" + short_digits(summary.lower) + ", " +
           short_digits(summary.upper) + "]";
}

void print_table(const std::vector<std::vector<std::string>>& rows)
{
    std::vector<std::size_t> widths(rows.front().size(), 0);
    for (const auto& row : rows)
        for (std::size_t i = 0; i < row.size(); ++i)
            widths[i] = (std::max)(widths[i], columns(row[i]));
    std::size_t total = 0;
    for (const std::size_t width : widths) total += width + 2;
    bool head = true;
    for (const auto& row : rows) {
        std::string line;
        for (std::size_t i = 0; i < row.size(); ++i) {
            const std::string space(widths[i] - columns(row[i]), ' ');
            line += i == 0 ? row[i] + space : "  " + space + row[i];
        }
        while (line.ends_with(' ')) line.pop_back();
        std::printf("%s\n", line.c_str());
        if (head) std::printf("%s\n", std::string(total - 2, '-').c_str());
        head = false;
    }
    std::printf("\n");
    std::fflush(stdout);
}

}  // namespace compare
