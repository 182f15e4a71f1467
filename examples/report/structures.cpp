#include "structures.hpp"

#include <chrono>

#include "../support/checked.hpp"

namespace report {

namespace {

/// Makes something, and says how long that took, in milliseconds.
template <class Make>
double timed(const Make& make)
{
    const auto start = std::chrono::steady_clock::now();
    make();
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
}

}  // namespace

const Prepared<nook::Bvh>& Structures::hierarchy()
{
    if (hierarchy_) return *hierarchy_;
    auto made = std::make_unique<Prepared<nook::Bvh>>();
    made->milliseconds = timed(
        [&] { support::checked(made->value.build(scene_.mesh(), {}, threads_), "Bvh::build"); });
    made->bytes = made->value.memory_size();
    hierarchy_ = std::move(made);
    return *hierarchy_;
}

const Prepared<nook::OutlineShell>& Structures::shell()
{
    if (shell_) return *shell_;
    auto made = std::make_unique<Prepared<nook::OutlineShell>>();
    made->milliseconds =
        timed([&] { support::checked(made->value.build(scene_.mesh()), "OutlineShell::build"); });
    // What it saves is what it keeps.
    made->bytes = made->value.saved_size();
    shell_ = std::move(made);
    return *shell_;
}

}  // namespace report
