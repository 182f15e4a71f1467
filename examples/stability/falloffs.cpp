#include <cmath>
#include <limits>
#include <utility>

#include <nook/scene/traced_ao.hpp>

#include "../support/checked.hpp"
#include "random.hpp"
#include "stability.hpp"
#include "textbook_rays.hpp"
#include "worst.hpp"

namespace stability {

namespace {

template <class T>
double naive(double sigma, double distance)
{
    return double{1 - std::exp(-static_cast<T>(sigma) * static_cast<T>(distance))};
}

double nook_falloff(double sigma, double distance)
{
    return nook::ExponentialFalloff{sigma}(distance);
}

/// What nook makes of the rays from a floor under the open sky.
double nook_open(double sigma, double)
{
    textbook::Mesh floor;
    floor.add_triangle({-1, 0, -1}, {-1, 0, 3}, {3, 0, -1});
    nook::Bvh bvh;
    support::checked(bvh.build(floor.view()), "the floor");
    using Options = nook::TracedOptions<nook::ExponentialFalloff>;
    return nook::traced_visibility(bvh, {0, 0, 0}, {0, 1, 0},
                                   Options{.directions = 64, .falloff = {sigma}});
}

using Falloff = double (*)(double sigma, double distance);
struct FalloffAlgorithm {
    Label label;
    Falloff hit, open;
};

constexpr double sigma = 0.25;

/// Relative errors over distances with σ d from `least` to ten times as much.
Worst errors(Falloff falloff, double least)
{
    constexpr int count = 1000;
    Random random;
    Worst worst;
    for (int i = 0; i < count; ++i) {
        // A float, so that every algorithm is given the same; the product with σ is exact.
        const double distance =
            double{static_cast<float>(least / sigma * std::pow(10, random.unit()))};
        const long double exact = -std::expm1(-static_cast<long double>(sigma * distance));
        const double value = falloff(sigma, distance);
        const long double error = static_cast<long double>(value) - exact;
        worst.add(static_cast<double>(std::fabs(error) / exact), [&] {
            return joined("distance ", distance, ": ", value, " for ", static_cast<double>(exact));
        });
    }
    return worst;
}

}  // namespace

Family falloffs()
{
    Family family;
    family.label = {"rays-falloff",
                    "what a ray lets through, 1 - exp(-sigma d), against expm1 in "
                    "long double"};
    family.metrics = {{"error", "largest relative error"}, {"nan", "distances that give NaN"}};
    const FalloffAlgorithm algorithms[] = {
        {{"naive-float", "1 - exp(-sigma d) in float"}, naive<float>, naive<float>},
        {{"naive-double", "the same in double"}, naive<double>, naive<double>},
        {{"nook", "ExponentialFalloff; traced_visibility for the miss"}, nook_falloff, nook_open},
    };
    for (const FalloffAlgorithm& algorithm : algorithms)
        family.algorithms.push_back(algorithm.label);
    const auto add_row = [&](const char* name, const Label& algorithm, double of_sigma,
                             const Worst& worst) {
        Row row{name, algorithm.name, {{"sigma", of_sigma}}, {worst.value(), worst.nans()}};
        set_worst(row, 0, worst, 1);
        family.rows.push_back(std::move(row));
    };
    struct Decade {
        const char *name, *what;
        double least;
    };
    for (const auto& [name, what, least] :
         {Decade{"hit-1e-9", "hits with sigma d from 1e-9 to 1e-8", 1e-9},
          Decade{"hit-1e-7", "from 1e-7 to 1e-6", 1e-7}, Decade{"hit-1e-5", "1e-5 to 1e-4", 1e-5},
          Decade{"hit-1e-3", "1e-3 to 1e-2", 1e-3}, Decade{"hit-1", "1 to 10", 1}}) {
        family.cases.push_back({name, what});
        for (const FalloffAlgorithm& algorithm : algorithms)
            add_row(name, algorithm.label, sigma, errors(algorithm.hit, least));
    }
    family.cases.push_back(
        {"miss", "no hit: an infinite d with sigma 0, to let through exactly 1"});
    for (const FalloffAlgorithm& algorithm : algorithms) {
        const double open = algorithm.open(0, std::numeric_limits<double>::infinity());
        Worst worst;
        worst.add(std::fabs(open - 1),
                  [&] { return joined("distance inf, sigma 0: ", open, " for 1"); });
        add_row("miss", algorithm.label, 0, worst);
    }
    return family;
}

}  // namespace stability
