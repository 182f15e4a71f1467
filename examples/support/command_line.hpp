#pragma once

#include <algorithm>
#include <string>
#include <thread>

#include <CLI/CLI.hpp>

#include <nook/version.hpp>

#include "failure.hpp"

namespace support {

/// Gives a program --version, and takes the last of an option that is repeated.
inline void set_up(CLI::App& app)
{
    app.set_version_flag("--version", std::string{"nook "} + std::string{nook::version});
    app.option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
}

/// Adds --threads, by default as many as the machine runs at once.
inline void add_threads(CLI::App& app, int& threads, const char* what)
{
    constexpr int most = 1024;
    threads = std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, most);
    app.add_option("--threads", threads, what)
        ->type_name("N")
        ->check(CLI::Range(1, most))
        ->capture_default_str();
}

/// Returns false when the command line has been answered and there is nothing left to do. Throws
/// Failure.
[[nodiscard]] inline bool parse(CLI::App& app, int argc, const char* const* argv)
{
    try {
        app.parse(argc, argv);
        return true;
    } catch (const CLI::Success& done) {
        app.exit(done);
        return false;
    } catch (const CLI::ParseError& error) {
        throw Failure{error.what()};
    }
}

}  // namespace support
