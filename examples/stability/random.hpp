#pragma once

#include <cmath>
#include <cstdint>
#include <random>

namespace stability {

/// Reproducible on every machine, unlike the distributions of the standard library.
class Random {
public:
    /// A multiple of 2⁻²⁴ in (0, 1].
    double unit() { return std::ldexp(double(engine_() >> 8) + 1, -24); }
    /// Mean 0 and standard deviation `sigma`.
    double noise(double sigma) { return (unit() - 0.5) * std::sqrt(12.0) * sigma; }
    int below(int count) { return static_cast<int>(engine_() % static_cast<unsigned>(count)); }

private:
    std::mt19937 engine_{20210719};
};

}  // namespace stability
