#pragma once

#include <filesystem>

#include <nlohmann/json.hpp>

#include "subject.hpp"
#include "table.hpp"

namespace outlines {

/// What the paper calls the best solution where objects are concave: the shells are those of convex
/// hulls, and what an object hides of itself is baked into its vertices and multiplied. Measures both
/// and adds the tables; scenes that are rooms have no hull to speak of.
void add_hulls(const Subject& subject, const Protocol& protocol,
               const std::filesystem::path& folder, nook::ThreadExecutor& threads,
               nlohmann::ordered_json& tables);

}  // namespace outlines
