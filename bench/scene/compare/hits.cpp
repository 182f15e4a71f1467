#include "parts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>

#include "common.hpp"

namespace compare {

namespace {

using Vector = std::array<double, 3>;

Vector operator-(const Vector& a, const Vector& b)
{
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Vector cross(const Vector& a, const Vector& b)
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double length(const Vector& a) { return std::sqrt(dot(a, a)); }

/// The triangles of a mesh in double, and what tells how close a decision was.
class Judge {
public:
    explicit Judge(const nook::MeshView& mesh)
    {
        const std::size_t count = (mesh.triangle_count + 7) / 8 * 8;
        for (std::size_t k = 0; k < 9; ++k) {
            corners_[k].resize(count);
            for (std::size_t t = 0; t < count; ++t) {
                const std::size_t triangle = (std::min)(t, mesh.triangle_count - 1);
                const std::size_t vertex = mesh.indices[3 * triangle + k / 3];
                corners_[k][t] = double{mesh.positions[3 * vertex + k % 3]};
            }
            soup_.corners[k] = corners_[k].data();
        }
        soup_.count = count;
    }
    [[nodiscard]] std::vector<char> hits(const std::vector<SoupRay>& rays) const
    {
        const std::unique_ptr<bool[]> found{new bool[rays.size()]};
        targets().best().brute_force(soup_, rays.data(), rays.size(), found.get());
        return {found.get(), found.get() + rays.size()};
    }
    /// How much would have to change for another answer: of angles the sine, between the ray and an
    /// edge; of distances the share. The triangle that decides counts.
    [[nodiscard]] double margin(const SoupRay& ray) const
    {
        const Vector origin{ray.origin[0], ray.origin[1], ray.origin[2]};
        const Vector direction{ray.direction[0], ray.direction[1], ray.direction[2]};
        double most = -std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < soup_.count; ++i) {
            const auto corner = [&](std::size_t k) -> Vector {
                return Vector{corners_[k][i], corners_[k + 1][i], corners_[k + 2][i]} - origin;
            };
            const Vector a = corner(0), b = corner(3), c = corner(6);
            const Vector bc = cross(b, c), ca = cross(c, a), ab = cross(a, b);
            const double u = dot(direction, bc), v = dot(direction, ca), w = dot(direction, ab);
            const double volume = u + v + w;
            if (volume == 0) continue;
            const double sign = volume < 0 ? -1 : 1;
            const auto sine = [&](double value, const Vector& plane) {
                const double size = length(plane);
                return size > 0 ? sign * value / size : 0;
            };
            const double t = dot(a, bc) / volume;
            const double past = std::isfinite(ray.radius) ? 1 - t / ray.radius : 1;
            const double scale = (std::max)({length(a), length(b), length(c)});
            const double before = scale > 0 ? t / scale : 0;
            most =
                (std::max)(most, (std::min)({sine(u, bc), sine(v, ca), sine(w, ab), past, before}));
        }
        return std::fabs(most);
    }

private:
    std::array<std::vector<double>, 9> corners_;
    Soup soup_{};
};

/// A ray on which somebody differs from somebody.
struct Case {
    SoupRay ray;
    bool nook, embree, robust;
};

class Inquiry {
public:
    Inquiry(const View& view, const Options& options, Results& results, Mark& mark)
        : view_{view},
          options_{options},
          results_{results},
          mark_{mark},
          bvh_{best_, view.scene.mesh()},
          judge_{view.scene.mesh()}
    {
        for (int i = 0; i + 1 < targets_.count; ++i)
            others_.push_back(std::make_unique<NookBvh>(*targets_.kernels[i], view.scene.mesh()));
        if (!has_embree()) return;
        embree_.emplace(view.scene.mesh(), EmbreeScene::Mode::plain);
        robust_.emplace(view.scene.mesh(), EmbreeScene::Mode::robust);
    }

    /// A defect may leave so many rays that to judge all of them would take days.
    static constexpr std::size_t most_judged = 800;

    void run(std::vector<std::vector<std::string>>& rows)
    {
        for (const int directions : {16, 64})
            for (const Reach& reach : reaches) rows.push_back(look(reach, directions));
    }

private:
    [[nodiscard]] std::vector<std::string> look(const Reach& reach, int directions)
    {
        const Sampling sampling = view_.sampling(reach, directions);
        const Points points = view_.points;
        std::vector<float> kernel(points.count);
        (void)checked(best_.traced_ao(bvh_, points, sampling, kernel.data(), {}), "traced_ao");

        std::vector<char> same(points.count, 1);
        std::vector<float> other(points.count);
        for (std::size_t i = 0; i < others_.size(); ++i) {
            (void)checked(
                targets_.kernels[i]->traced_ao(*others_[i], points, sampling, other.data(), {}),
                "traced_ao");
            for (std::size_t point = 0; point < points.count; ++point)
                if (other[point] != kernel[point]) same[point] = 0;
        }

        // Every ray by the three of them; a sample by brute force as well.
        const double rays = double(points.count) * directions;
        const std::size_t every = (std::max)(
            static_cast<std::size_t>(rays / (options_.quick ? 100 : 12500)), std::size_t{1});
        std::vector<Case> differ, kernel_differs;
        std::vector<SoupRay> sample;
        std::vector<char> answers;
        std::size_t index = 0, embree_differs = 0, robust_differs = 0;
        const auto rays_per_point = static_cast<std::size_t>(directions);
        std::vector<float> xyz(3 * rays_per_point);
        for (std::size_t point = 0; point < points.count; ++point) {
            best_.directions(points, point, sampling, xyz.data());
            const float* const from = points.positions + 3 * point;
            int open = 0;
            std::vector<Case> here;
            for (int i = 0; i < directions; ++i, ++index) {
                const float* const along = &xyz[3 * static_cast<std::size_t>(i)];
                Case one{};
                for (int k = 0; k < 3; ++k) {
                    one.ray.origin[k] = double{from[k]};
                    one.ray.direction[k] = double{along[k]};
                }
                one.ray.radius = sampling.radius;
                one.nook = best_.occluded(bvh_, {.origin = {from[0], from[1], from[2]},
                                                 .direction = {along[0], along[1], along[2]},
                                                 .t_max = sampling.radius});
                one.embree = one.robust = one.nook;
                if (embree_) {
                    one.embree =
                        best_.embree_occluded(embree_->handle(), from, along, sampling.radius);
                    one.robust =
                        best_.embree_occluded(robust_->handle(), from, along, sampling.radius);
                }
                open += !one.nook;
                embree_differs += one.embree != one.nook;
                robust_differs += one.robust != one.nook;
                if (one.embree != one.nook || one.robust != one.nook) differ.push_back(one);
                here.push_back(one);
                if (index % every == 0) {
                    sample.push_back(one.ray);
                    answers.push_back(one.nook);
                }
            }
            if (kernel[point] != static_cast<float>(open) / static_cast<float>(directions))
                kernel_differs.insert(kernel_differs.end(), here.begin(), here.end());
        }

        // Who is right where they differ?
        std::vector<SoupRay> doubtful;
        for (const Case& one : differ) doubtful.push_back(one.ray);
        const std::vector<char> truth = judge_.hits(doubtful);
        std::size_t nook_wrong = 0, embree_wrong = 0, robust_wrong = 0;
        double margin = 0, closest_wrong = 0;
        for (std::size_t i = 0; i < differ.size(); ++i) {
            const bool hit = truth[i] != 0;
            const double here = i < most_judged ? judge_.margin(differ[i].ray) : 0;
            margin = (std::max)(margin, here);
            nook_wrong += differ[i].nook != hit;
            embree_wrong += differ[i].embree != hit;
            robust_wrong += differ[i].robust != hit;
            if (differ[i].nook != hit) closest_wrong = (std::max)(closest_wrong, here);
        }
        const std::vector<char> sampled = judge_.hits(sample);
        std::size_t sample_wrong = 0;
        for (std::size_t i = 0; i < sample.size(); ++i) {
            if ((sampled[i] != 0) == (answers[i] != 0)) continue;
            ++sample_wrong;
            closest_wrong = (std::max)(closest_wrong, judge_.margin(sample[i]));
        }
        // A point on which the kernel differs has one ray, at least, that is closer than any other.
        double kernel_margin = 0;
        const std::size_t judged = (std::min)(kernel_differs.size(), most_judged);
        for (std::size_t i = 0; i < judged; i += rays_per_point) {
            double least = std::numeric_limits<double>::infinity();
            for (std::size_t k = i; k < i + rays_per_point; ++k)
                least = (std::min)(least, judge_.margin(kernel_differs[k].ray));
            kernel_margin = (std::max)(kernel_margin, least);
        }
        closest_wrong = (std::max)(closest_wrong, kernel_margin);

        const double steps = closest_wrong * 0x1p24;
        mark_.take({steps, steps, steps}, place(view_, reach, directions));
        const auto record = [&](const char* peer, double count, double wrong_peer) {
            results_.disagreements.push_back({.scene = view_.scene.name,
                                              .radius = reach.name,
                                              .directions = directions,
                                              .one = "nook",
                                              .other = peer,
                                              .rays = rays,
                                              .differ = count,
                                              .wrong_one = double(nook_wrong),
                                              .wrong_other = wrong_peer,
                                              .margin = margin});
        };
        if (embree_) {
            record("Embree", double(embree_differs), double(embree_wrong));
            record("Embree, robust", double(robust_differs), double(robust_wrong));
        }
        record("brute force, sample", double(sample_wrong), 0);
        const std::size_t kernel_points = kernel_differs.size() / rays_per_point;
        return {place(view_, reach, directions),
                digits("%.0f", rays),
                embree_ ? std::to_string(embree_differs) : "-",
                embree_ ? std::to_string(robust_differs) : "-",
                std::to_string(nook_wrong) + " / " + std::to_string(embree_wrong) + " / " +
                    std::to_string(robust_wrong),
                digits("%.1e", margin),
                std::to_string(sample_wrong) + " of " + std::to_string(sample.size()),
                std::to_string(kernel_points),
                digits("%.1e", kernel_margin),
                std::to_string(std::count(same.begin(), same.end(), 0))};
    }

    const View& view_;
    const Options& options_;
    Results& results_;
    Mark& mark_;
    Targets targets_ = targets();
    const Kernels& best_ = targets_.best();
    NookBvh bvh_;
    /// Of the other instruction sets.
    std::vector<std::unique_ptr<NookBvh>> others_{};
    Judge judge_;
    std::optional<EmbreeScene> embree_{}, robust_{};
};

}  // namespace

void compare_hits(const Options& options, const std::vector<View>& views, Results& results)
{
    // In steps of a float below 1: coordinates and directions are floats, so a ray that passes that
    // close to an edge, or ends that close to a triangle, is a tie.
    Mark mark{"hits that differ from a brute force in double: margin, 2^-24", false, 256, 1e-300};
    std::vector<std::vector<std::string>> rows{
        {"", "rays", "differ from Embree", "from robust", "wrong: nook / Embree / robust",
         "largest margin", "sample differs from brute force", "points: kernel differs from rays",
         "margin", "points: instruction sets differ"}};
    for (const View& view : views) Inquiry{view, options, results, mark}.run(rows);
    std::printf("hits, nook %s: rays whose answers differ, and who is right by a brute force\n",
                targets().best().name);
    print_table(rows);
    results.marks.push_back(mark);
}

}  // namespace compare
