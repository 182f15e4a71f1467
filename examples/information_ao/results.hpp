#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <nook/scene/mesh.hpp>
#include <nook/thread_executor.hpp>

#include "../scenes/scene.hpp"
#include "../support/picture.hpp"
#include "maps.hpp"
#include "run.hpp"

namespace information {

/// Everything that is measured.
struct Results {
    const scenes::Scene& scene;
    nook::MeshView mesh;
    Views views;
    Maps maps;
    std::optional<Channel> channel;
    std::vector<float> traced;
    std::optional<Maps> important, refined;
    std::vector<float> relit;  ///< three per polygon, in [0, 1]
};

/// The table for people.
void print(const CommandLine& command, const Results& results);

/// The contents of information.json.
[[nodiscard]] nlohmann::ordered_json json_of(const CommandLine& command, const Results& results);

/// A picture and its name without .png.
struct NamedPicture {
    std::string file;
    support::Picture picture;
};
/// Every picture that was asked for.
[[nodiscard]] std::vector<NamedPicture> draw(const CommandLine& command, const Results& results,
                                             nook::ThreadExecutor& threads);

}  // namespace information
