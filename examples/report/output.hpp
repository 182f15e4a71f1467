#pragma once

#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "../stability/stability.hpp"
#include "kernels.hpp"
#include "options.hpp"

namespace report {

/// What is kept of one scene: numbers, no images.
struct SceneReport {
    std::string name;
    std::size_t triangles = 0, dropped = 0;
    int width = 0, height = 0;
    double background_share = 0;
    bool orthographic = false;

    int rays = 0;
    double radius = 0, reference_seconds = 0, build_seconds = 0, standard_error = 0;
    std::uint64_t rays_traced = 0, rays_skipped = 0;
    int slices = 0, height_field_step = 1;
    double height_field_seconds = 0;
    nook::ErrorMetrics unknown;  ///< the height field against the traced reference

    struct Row {
        std::string kernel, brief;
        nlohmann::ordered_json parameters;
        std::vector<Timing> timings;
        int row_step = 1;
        nook::ErrorMetrics error;
        double ssim = 1;
        nook::ErrorMetrics height_field;
        std::optional<nook::ErrorMetrics> exact;
        nook::Work work;
    };
    std::vector<Row> rows;
    /// The separable range check less the one per sample.
    nook::ErrorMetrics range_checks;
};

/// The contents of report.json.
[[nodiscard]] nlohmann::ordered_json json_of(const std::vector<SceneReport>& scenes,
                                             const std::vector<stability::Family>& families,
                                             const Options& options);

/// The table for people.
void print_table(std::ostream& out, const std::vector<SceneReport>& scenes);

}  // namespace report
