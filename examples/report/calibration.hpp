#pragma once

#include <nlohmann/json.hpp>

#include <nook/thread_executor.hpp>

#include "../support/progress.hpp"

namespace report {

using Json = nlohmann::ordered_json;

/// Finds, for each kernel and time budget, the parameters of the least error on some scenes and cameras,
/// and measures them and the library's defaults on others. The `calibration` of report.json.
[[nodiscard]] Json calibrate(bool quick, nook::ThreadExecutor& threads,
                             support::Progress& progress);

}  // namespace report
