#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <nook/scene/outline.hpp>

#include "subject.hpp"

namespace outlines {

/// How a table is made (Park & Baek 2021, table 1: 1080 × 720, 4 samples, a camera that turns; blur and
/// lighting left out).
struct Protocol {
    int width = 1080, height = 720;
    int frames = 24;
    std::vector<int> samples{4, 16};
    /// Rays per pixel and slices of the references; every how many rows they are computed.
    int rays = 64, slices = 32, row_step = 6;
    /// Frames that are compared with the references.
    int reference_frames = 2;
};

/// Against what a picture is measured: RMSE over the surface pixels.
struct Errors {
    double full = 0;  ///< the same kernel without a mask
    double traced = 0, height_field = 0;
};

/// Times in milliseconds per frame on one thread.
struct Row {
    std::string kernel;
    int samples = 0;
    Times full, masked;  ///< masked: the mask included
    Errors full_errors, errors;
};

/// One scene with one shell.
struct Table {
    std::string scene, shell;
    std::size_t triangles = 0, shell_triangles = 0, objects = 0, inward = 0;
    double radius = 0, extent = 0, needed_extent = 0;
    int threshold = 2;
    /// Share of the surface pixels that lie in two shells, and that are computed since their groups are
    /// active.
    double stencil = 0, computed = 0;
    Times mask, alone;
    Errors alone_errors;
    std::vector<Row> rows;
};

/// Visibility at the corners of all triangles of a scene, for a mesh whose triangles share none.
struct Baked {
    std::vector<float> positions, values;
    std::vector<std::uint32_t> indices;
};

/// Runs the protocol. Frames come one after the other; within a frame contenders take turns. Pictures of
/// the first frame go to `folder` with `prefix`. What is baked is multiplied with what is masked.
[[nodiscard]] Table measure(const Subject& subject, const std::string& shell_name,
                            const nook::OutlineShell& shell, double extent,
                            const Protocol& protocol, const std::filesystem::path& folder,
                            const std::string& prefix, nook::ThreadExecutor& threads,
                            const Baked* baked = nullptr);

void print(const Table& table);
[[nodiscard]] nlohmann::ordered_json json_of(const Table& table);

}  // namespace outlines
