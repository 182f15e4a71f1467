#pragma once

#include <charconv>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <string>
#include <string_view>

#include "stability.hpp"

namespace stability {

namespace detail {

inline void append(std::string& text, std::string_view piece) { text += piece; }
template <std::floating_point T>
void append(std::string& text, T piece)
{
    // Its sign differs from machine to machine.
    if (std::isnan(piece)) return append(text, std::string_view{"NaN"});
    char digits[32];
    text.append(digits, std::to_chars(digits, digits + sizeof digits, piece).ptr);
}
template <std::integral T>
void append(std::string& text, T piece)
{
    text += std::to_string(piece);
}

}  // namespace detail

/// Strings and numbers one after the other; numbers with the fewest digits that bring them back as what
/// they are, float or double.
template <class... Pieces>
[[nodiscard]] std::string joined(const Pieces&... pieces)
{
    std::string text;
    (detail::append(text, pieces), ...);
    return text;
}

/// The largest of some values, what it came from, and how many are NaN, which is worse than any number.
class Worst {
public:
    /// `input()` tells in a line what the value came from. Asked of the worst so far alone, and not
    /// for 0. The first of equals stays.
    template <class Input>
    void add(double value, const Input& input)
    {
        const bool is_nan = std::isnan(value);
        if (is_nan) ++nans_;
        if (std::isnan(value_) || !(is_nan || value > value_)) return;
        value_ = value;
        input_ = input();
    }
    /// 0 of none; NaN when one is.
    [[nodiscard]] double value() const { return value_; }
    [[nodiscard]] double nans() const { return static_cast<double>(nans_); }
    /// Empty where all values are 0.
    [[nodiscard]] const std::string& input() const { return input_; }

private:
    double value_ = 0;
    std::size_t nans_ = 0;
    std::string input_;
};

/// Gives the row a worst input if it has none yet. A NaN is the worst input of the metric `nan`.
inline void set_worst(Row& row, std::size_t metric, const Worst& worst, std::size_t nan)
{
    if (!row.worst.empty()) return;
    row.worst = worst.input();
    row.worst_metric = std::isnan(worst.value()) ? nan : metric;
}

}  // namespace stability
