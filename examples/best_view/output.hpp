#pragma once

#include <filesystem>

#include <nook/thread_executor.hpp>

#include "../scenes/scene.hpp"
#include "../support/progress.hpp"
#include "views.hpp"

namespace best_view {

/// Prints the ranking as a table.
void print(const scenes::Scene& scene, const Task& task, const Views& views);

/// Names of what is written. A run refuses when one of them is a folder.
inline constexpr const char *json_name = "views.json", *sheet_name = "views.png";

/// Writes a picture of each chosen view, all of them on one sheet, and views.json.
void write(const std::filesystem::path& folder, const scenes::Scene& scene, const Task& task,
           const Views& views, int size, nook::ThreadExecutor& threads,
           support::Progress& progress);

}  // namespace best_view
