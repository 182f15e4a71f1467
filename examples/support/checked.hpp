#pragma once

#include <string>

#include <nook/outcome.hpp>

#include "failure.hpp"

namespace support {

/// The error as text.
[[nodiscard]] inline std::string text_of(const nook::Error& error)
{
    char text[256];
    nook::describe(error, text, sizeof text);
    return text;
}

/// Throws Failure if the call failed.
inline nook::Work checked(const nook::Outcome& outcome, const char* what)
{
    if (!outcome) throw Failure{std::string{what} + ": " + text_of(outcome.error)};
    return outcome.work;
}

}  // namespace support
