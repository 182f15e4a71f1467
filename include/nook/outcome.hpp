#pragma once

#include <bit>
#include <charconv>
#include <cstddef>
#include <cstdint>

#include <nook/target.hpp>

namespace nook {

/// Why a call did nothing.
enum class ErrorCode : std::uint8_t {
    none,
    null_data,           ///< a null pointer where there are elements
    bad_size,            ///< a size that is negative, too large, or differs from the other images'
    bad_stride,          ///< pixels of an output that would share memory
    overlap,             ///< an output that shares memory with an input
    bad_value,           ///< an option outside its range, or NaN
    index_out_of_range,  ///< a mesh index that names no vertex
    scratch_too_small,
    out_of_memory,
};

/// What was wrong: which argument, its value, and what is allowed. Trivially copyable; the
/// strings are literals. Converts to true when there is an error.
struct Error {
    ErrorCode code = ErrorCode::none;
    /// The name of the argument or option, for example "options.window".
    const char* argument = "";
    /// Its value; for images the offending extent, for indices the index.
    double value = 0;
    /// What is allowed, for example "an odd number >= 1".
    const char* allowed = "";

    NOOK_INLINE constexpr explicit operator bool() const { return code != ErrorCode::none; }
};

/// What a call did and what it left out.
struct Work {
    std::uint64_t pixels = 0;      ///< pixels written
    std::uint64_t background = 0;  ///< of these, pixels that hold no surface
    std::uint64_t skipped = 0;     ///< of these, surface pixels that were spared as a whole
    std::uint64_t samples = 0;     ///< samples read by kernels whose count depends on the input
    std::uint64_t skipped_samples = 0;  ///< the others: told by their height alone
    std::uint64_t rays = 0;             ///< rays traced
    std::uint64_t skipped_rays = 0;     ///< rays spared: nothing in reach, or the estimate was done
    std::uint64_t passes = 0;           ///< passes over the image
    std::uint64_t skipped_passes = 0;   ///< passes that had nothing to do

    NOOK_INLINE constexpr Work& operator+=(const Work& other)
    {
        pixels += other.pixels;
        background += other.background;
        skipped += other.skipped;
        samples += other.samples;
        skipped_samples += other.skipped_samples;
        rays += other.rays;
        skipped_rays += other.skipped_rays;
        passes += other.passes;
        skipped_passes += other.skipped_passes;
        return *this;
    }
};

/// What every kernel returns. Converts to true on success. On an error nothing has been written.
struct [[nodiscard]] Outcome {
    Error error{};
    Work work{};

    NOOK_INLINE constexpr explicit operator bool() const { return !error; }
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Writes the error as one line of text without a newline, for example
/// `options.window is 4; allowed: an odd number >= 1`, cut to `capacity` and zero-terminated.
/// Returns the length written, without the zero. Does not depend on the locale.
inline std::size_t describe(const Error& error, char* buffer, std::size_t capacity)
{
    if (buffer == nullptr || capacity == 0) return 0;
    std::size_t length = 0;
    const auto append = [&](const char* text) {
        while (*text != '\0' && length + 1 < capacity) buffer[length++] = *text++;
    };
    char number[32] = {};
    // Whole numbers, such as sizes and indices, without an exponent. NaN and infinity are told by
    // their bits, for -ffast-math.
    const bool finite = (std::bit_cast<std::uint64_t>(error.value) >> 52 & 0x7ff) != 0x7ff;
    const bool whole = finite && error.value > -1e15 && error.value < 1e15 &&
                       error.value == static_cast<double>(static_cast<std::int64_t>(error.value));
    if (whole)
        std::to_chars(number, number + sizeof number - 1, static_cast<std::int64_t>(error.value));
    else std::to_chars(number, number + sizeof number - 1, error.value);
    if (!error) {
        append("no error");
    } else {
        append(error.argument);
        switch (error.code) {
        case ErrorCode::null_data: append(" is null"); break;
        case ErrorCode::overlap: append(" shares memory with an input"); break;
        default: append(" is "); append(number);
        }
        append("; allowed: ");
        append(error.allowed);
    }
    buffer[length] = '\0';
    return length;
}

}  // namespace nook::inline NOOK_TARGET
