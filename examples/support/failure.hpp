#pragma once

#include <stdexcept>

namespace support {

/// A run that cannot go on. Its text is one line that names the thing, fit for stderr.
struct Failure : std::runtime_error {
    using std::runtime_error::runtime_error;
};

}  // namespace support
