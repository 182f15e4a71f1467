#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <nook/checks.hpp>
#include <nook/depth/projection.hpp>
#include <nook/execution.hpp>
#include <nook/image.hpp>
#include <nook/outcome.hpp>
#include <nook/scene/camera.hpp>
#include <nook/scene/mesh.hpp>
#include <nook/scene/triangle_surface.hpp>
#include <nook/scene/vector.hpp>
#include <nook/scratch.hpp>
#include <nook/tasks.hpp>
#include <nook/work_map.hpp>

namespace nook {

struct VertexValuesOptions {
    /// Multiply what the output holds, so that baked and screen-space occlusion combine, instead of
    /// replacing it. A pixel that is not finite counts as 1.
    bool multiply = false;
};

}  // namespace nook

namespace nook::inline NOOK_TARGET {

/// Draws values at vertices, such as baked occlusion, into the picture of a mesh: at each pixel the
/// values of its triangle, interpolated over the triangle in space (perspective-correct).
///
/// `ids` are the face ids that `rasterise` wrote for this mesh, frame and projection, `values` one
/// float per vertex of the mesh; one that is not finite counts as 1. The output is float or double.
/// A pixel lies between the least and the greatest value of its triangle, and three equal values
/// are reproduced exactly. Without a surface (`no_face`, ids beyond the mesh, unusable triangles)
/// and in inactive groups of the work map the value is 1: written, or nothing to multiply with.
///
/// Scratch: `vertex_values_scratch_size`. Tasks are bands of eight rows.
template <class Value, ScratchSource S = HeapScratch, Executor E = Serial>
Outcome vertex_values(const MeshView& mesh, const ImageView<const std::uint32_t>& ids,
                      const float* values, const ImageView<Value>& output,
                      const VertexValuesOptions& options, const Projection& projection,
                      const ViewFrame& frame, const WorkMap& work_map = {}, S&& scratch = S{},
                      E&& executor = E{});

/// Bytes of scratch that `vertex_values` needs for a number of workers.
[[nodiscard]] std::size_t vertex_values_scratch_size(int workers);

namespace detail {

/// The values of the triangle that the last pixel showed; neighbours mostly show the same.
class ValueTriangle {
public:
    ValueTriangle(const MeshView& mesh, const float* values, const Frame& frame,
                  const Projection& projection)
        : mesh_{mesh},
          values_{values},
          frame_{frame},
          projection_{projection},
          near_plane_{double{(std::numeric_limits<float>::min)()}},
          surface_{projection, near_plane_, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}
    {
        if (is_finite(projection.near_plane))
            near_plane_ = (std::max)(near_plane_, projection.near_plane);
    }

    /// Takes the triangle with this id; false when it is no surface.
    [[nodiscard]] bool take(std::uint32_t id)
    {
        if (id == id_) return usable_;
        id_ = id;
        usable_ = id < mesh_.triangle_count && is_usable_triangle(mesh_, id);
        if (!usable_) return false;
        const Triangle world = mesh_triangle(mesh_, id);
        corner_[0] = frame_.direction_to_view(world.a - frame_.origin);
        corner_[1] = frame_.direction_to_view(world.b - frame_.origin);
        corner_[2] = frame_.direction_to_view(world.c - frame_.origin);
        plane_ = cross(corner_[1] - corner_[0], corner_[2] - corner_[0]);
        surface_ = TriangleSurface{projection_, near_plane_, corner_[0], corner_[1], corner_[2]};
        for (std::size_t k = 0; k < 3; ++k) {
            const float value = values_[mesh_.indices[3 * std::size_t{id} + k]];
            value_[k] = is_finite(value) ? double{value} : 1;
        }
        return true;
    }
    /// The value at a pixel centre. The areas that the point cuts from the triangle are its
    /// weights.
    [[nodiscard]] double at(int x, int y) const
    {
        const double slope_x = surface_.slope_x(x), slope_y = surface_.slope_y(y);
        const double distance = surface_.distance(slope_x, slope_y);
        const double scale = projection_.orthographic ? 1 : distance;
        const Vector3 point{slope_x * scale, slope_y * scale, -distance};
        double weight[3];
        for (int k = 0; k < 3; ++k) {
            const Vector3 from = corner_[k == 2 ? 0 : k + 1] - point;
            const Vector3 to = corner_[k == 0 ? 2 : k - 1] - point;
            weight[k] = (std::max)(dot(cross(from, to), plane_), 0.0);
        }
        const double sum = weight[0] + weight[1] + weight[2];
        const double share = sum > 0 ? 1 / sum : 0;
        // From the first value on, so that equal values stay what they are.
        const double value = value_[0] + rounded((value_[1] - value_[0]) * (weight[1] * share)) +
                             rounded((value_[2] - value_[0]) * (weight[2] * share));
        const double least = (std::min)((std::min)(value_[0], value_[1]), value_[2]);
        const double most = (std::max)((std::max)(value_[0], value_[1]), value_[2]);
        return (std::min)((std::max)(value, least), most);
    }

private:
    const MeshView& mesh_;
    const float* values_;
    Frame frame_;
    Projection projection_;
    double near_plane_;
    TriangleSurface surface_;
    Vector3 corner_[3] = {}, plane_{};
    double value_[3] = {};
    std::uint32_t id_ = no_face;
    bool usable_ = false;
};

}  // namespace detail

template <class Value, ScratchSource S, Executor E>
Outcome vertex_values(const MeshView& mesh, const ImageView<const std::uint32_t>& ids,
                      const float* values, const ImageView<Value>& output,
                      const VertexValuesOptions& options, const Projection& projection,
                      const ViewFrame& frame, const WorkMap& work_map, S&& scratch, E&& executor)
{
    static_assert(std::is_floating_point_v<Value>, "values are float or double");
    Outcome outcome{};
    Error& error = outcome.error;
    if ((error = detail::check_input(ids, "ids"))) return outcome;
    if ((error = check_mesh(mesh))) return outcome;
    if (values == nullptr && mesh.triangle_count > 0)
        return {{ErrorCode::null_data, "values", 0, "one float per vertex"}};
    if ((error = detail::check_output(output, "output"))) return outcome;
    if ((error = detail::check_same_size(ids, output, "output"))) return outcome;
    if ((error = detail::check_apart(ids, output, "output"))) return outcome;
    constexpr std::size_t most = 0x7fffffff;
    const ImageView<const float> list{values, static_cast<int>((std::min)(mesh.vertex_count, most)),
                                      values != nullptr ? 1 : 0};
    if ((error = detail::check_apart(list, output, "output"))) return outcome;
    if ((error = check_projection(projection))) return outcome;
    if ((error = detail::check_frame(frame))) return outcome;
    if ((error = detail::check_work_map(work_map, output))) return outcome;
    if (output.empty()) return outcome;

    const int width = output.width, height = output.height;
    const detail::Frame axes{frame};
    constexpr int band = 8;
    const auto draw_band = [&](Work& work, int, int task, int) {
        detail::ValueTriangle triangle{mesh, values, axes, projection};
        const int top = task * band, bottom = top + (std::min)(band, height - top);
        for (int y = top; y < bottom; ++y)
            for (int x = 0; x < width; ++x) {
                const bool surface = triangle.take(ids(x, y));
                const bool active = surface && work_map.is_active(x, y);
                if (!active) ++(surface ? work.skipped : work.background);
                const double value = active ? triangle.at(x, y) : 1;
                double before = 1;
                if (options.multiply && detail::is_finite(output(x, y)))
                    before = double{output(x, y)};
                output(x, y) = static_cast<Value>(before * value);
            }
    };
    outcome = detail::run_tasks(detail::pieces(height, band), detail::NoMemory{}, draw_band,
                                scratch, executor);
    if (!outcome) return outcome;
    outcome.work.pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    outcome.work.passes = 1;
    return outcome;
}

inline std::size_t vertex_values_scratch_size(int workers)
{
    return detail::task_scratch_size(detail::NoMemory{}, workers);
}

}  // namespace nook::inline NOOK_TARGET
