#pragma once

#include <filesystem>

#include <nlohmann/json.hpp>

#include "subject.hpp"
#include "table.hpp"

namespace outlines {

/// From which share of active pixels on a mask costs more than it saves, by the triangles of the shells
/// and the samples of the kernel: prints it, draws `break-even.png` and returns the numbers.
[[nodiscard]] nlohmann::ordered_json break_even(const Subject& subject,
                                                const nook::OutlineShell& shell, double extent,
                                                const Protocol& protocol,
                                                const std::filesystem::path& folder,
                                                nook::ThreadExecutor& threads);

}  // namespace outlines
