#pragma once

#include <filesystem>

#include <nook/thread_executor.hpp>

#include "../support/progress.hpp"
#include "kernels.hpp"
#include "options.hpp"
#include "structures.hpp"
#include "subject.hpp"

namespace report {

/// What its camera is: eye, target, up, whether orthographic, and how much it sees.
[[nodiscard]] Json camera_of(const Cell& cell);

/// Draws, traces, runs and compares everything there is to a cell, and writes its pictures to the
/// folder. Returns the cell as it stands in report.json.
[[nodiscard]] Json measure(const Cell& cell, const Options& options, Structures& structures,
                           nook::ThreadExecutor& threads, const std::filesystem::path& folder,
                           support::Progress& progress);

}  // namespace report
