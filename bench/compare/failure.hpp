#pragma once

#include <stdexcept>
#include <string>

#include <nook/outcome.hpp>

namespace compare {

/// A run that cannot go on. Its text is one line, fit for stderr.
struct Failure : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Throws Failure if the call failed.
inline nook::Work checked(const nook::Outcome& outcome, const char* what)
{
    if (outcome) return outcome.work;
    char text[256];
    nook::describe(outcome.error, text, sizeof text);
    throw Failure{std::string{what} + ": " + text};
}

}  // namespace compare
