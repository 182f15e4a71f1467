#pragma once

#include <memory>
#include <string>
#include <utility>

#include <nook/owned_image.hpp>

#include "compare/failure.hpp"
#include "compare/rotation.hpp"
#include "compare/table.hpp"
#include "kernels.hpp"
#include "options.hpp"
#include "pictures.hpp"
#include "results.hpp"

/// What the parts share.
namespace compare {

/// The buffers of a turn are so large that bringing them into the caches first changes little.
[[nodiscard]] inline Effort effort(const Options& options, Clock clock = Clock::processor)
{
    return {.rounds = options.rounds,
            .turn_seconds = options.quick ? 1e-4 : 5e-3,
            .clock = clock,
            .untimed_call = false};
}

[[nodiscard]] inline nook::AlchemyOptions alchemy(const Picture& picture, int samples)
{
    return {.radius = picture.radius, .samples = samples};
}

/// The same with all that the plain loop chooses otherwise, for pictures that can be compared.
[[nodiscard]] inline nook::AlchemyOptions alike(const Picture& picture, int samples)
{
    nook::AlchemyOptions options = alchemy(picture, samples);
    options.intensity = 0.4 * picture.radius;
    options.bias = 1e-3;
    options.epsilon = 1e-4 * picture.radius * picture.radius;
    return options;
}

/// A call of a kernel of nook, with scratch of its own that the first call makes. `call(job)` returns an
/// Outcome.
template <class Call>
[[nodiscard]] Contender nook_contender(std::string name, Job job, Call call)
{
    const auto workspace = std::make_shared<Workspace>();
    job.workspace = workspace.get();
    std::string what = name;
    return {std::move(name), [job, workspace, call = std::move(call), what = std::move(what)] {
                (void)checked(call(job), what.c_str());
            }};
}

[[nodiscard]] inline Summary per_pixel(const Summary& seconds, std::size_t pixels)
{
    const double scale = 1e9 / double(pixels);
    return {seconds.median * scale, seconds.lower * scale, seconds.upper * scale};
}

/// What is common to the measurements of a rotation.
[[nodiscard]] inline Measurement measured(const char* part, const Picture& picture,
                                          const std::vector<Contender>& contenders,
                                          const Times& times, std::size_t i, std::size_t base)
{
    Measurement m;
    m.part = part;
    m.scene = picture.name;
    m.contender = contenders[i].name;
    m.width = picture.width();
    m.height = picture.height();
    m.nanoseconds = per_pixel(times.seconds(i), picture.pixels());
    m.base = contenders[base].name;
    m.ratio = times.ratio(i, base);
    return m;
}

/// Of visibility over the surfaces of a picture.
[[nodiscard]] Agreement difference(const Picture& picture, const nook::Image<float>& one,
                                   const nook::Image<float>& other);

/// Prints agreements, a line each.
void print_agreements(const std::vector<Agreement>& agreements);

}  // namespace compare
