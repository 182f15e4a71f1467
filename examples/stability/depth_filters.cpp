#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>

#include "exact.hpp"
#include "stability.hpp"
#include "worst.hpp"

namespace stability {

namespace {

/// Windows of a case that are measured exactly, and those of them that the case itself asks for.
constexpr std::size_t most_exact = 96, most_focus = 16;

/// The pixels whose window lies inside the image and holds no poison.
std::vector<Point> clean_pixels(const DepthInput& input, int radius)
{
    // How much poison lies above and to the left, in exact integers.
    nook::Image<int> table{width + 1, height + 1};
    if (input.poisoned.width() > 0)
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                table(x + 1, y + 1) =
                    input.poisoned(x, y) + table(x, y + 1) + table(x + 1, y) - table(x, y);
    std::vector<Point> clean;
    for (int y = radius; y < height - radius; ++y)
        for (int x = radius; x < width - radius; ++x) {
            const int left = x - radius, right = x + radius + 1;
            const int top = y - radius, bottom = y + radius + 1;
            if (table(right, bottom) - table(left, bottom) - table(right, top) + table(left, top) ==
                0)
                clean.push_back({x, y});
        }
    return clean;
}

/// At most `count` of the points: the first, the last, and others in between.
std::vector<Point> some_of(const std::vector<Point>& points, std::size_t count)
{
    if (points.size() <= count) return points;
    std::mt19937 random{7};
    std::vector<Point> chosen{points.front(), points.back()};
    // One from each of the equal parts.
    const std::size_t part = points.size() / (count - 2);
    for (std::size_t i = 0; i + 2 < count; ++i)
        chosen.push_back(points[i * part + random() % part]);
    return chosen;
}

std::vector<Point> exact_pixels(const DepthInput& input, const std::vector<Point>& clean)
{
    std::vector<Point> focus;
    for (const Point& wanted : input.focus)
        if (std::any_of(clean.begin(), clean.end(), [&](const Point& point) {
                return point.x == wanted.x && point.y == wanted.y;
            }))
            focus.push_back(wanted);
    focus = some_of(focus, most_focus);
    for (const Point& point : some_of(clean, most_exact - focus.size())) focus.push_back(point);
    return focus;
}

/// The largest error of a quantity, relative, absolute and in ulps. Infinite where a value is; NaN
/// where all values are.
class Errors {
public:
    explicit Errors(Precision precision) : precision_{precision} {}

    void add(double value, const exact::Wide& expected)
    {
        if (!exact::can_hold(expected.high, precision_)) return;
        if (std::isnan(value)) {
            has_nan_ = true;
            return;
        }
        any_ = true;
        const double error = exact::distance(value, expected);
        absolute_ = std::max(absolute_, error);
        ulps_ = std::max(ulps_, error / exact::ulp(expected.high, precision_));
        if (error > 0)
            relative_ =
                std::max(relative_, expected.high > 0 ? error / expected.high
                                                      : std::numeric_limits<double>::infinity());
    }
    [[nodiscard]] std::optional<double> relative() const { return result(relative_); }
    [[nodiscard]] std::optional<double> absolute() const { return result(absolute_); }
    [[nodiscard]] std::optional<double> ulps() const { return result(ulps_); }

private:
    [[nodiscard]] std::optional<double> result(double value) const
    {
        if (any_) return value;
        if (has_nan_) return std::numeric_limits<double>::quiet_NaN();
        return std::nullopt;
    }
    Precision precision_;
    bool any_ = false, has_nan_ = false;
    double relative_ = 0, absolute_ = 0, ulps_ = 0;
};

/// Calls f with each of the images that the algorithm fills.
template <class F>
bool any_output(const DepthOutput& output, const F& f)
{
    return (output.variance.width() > 0 && f(output.variance)) || f(output.visibility);
}

Row measure(const DepthCase& subject, const DepthAlgorithm& algorithm, const DepthInput& input,
            int window, const std::vector<Point>& clean, const std::vector<Point>& checked,
            const std::vector<exact::Window>& expected)
{
    const DepthOutput output = algorithm.run(input.depth, window);
    const bool has_variance = output.variance.width() > 0;
    Errors variance{algorithm.precision}, visibility{algorithm.precision};
    Worst worst;
    for (std::size_t i = 0; i < checked.size(); ++i) {
        const auto [x, y] = checked[i];
        const double value = output.visibility(x, y);
        const exact::Wide& truth = expected[i].visibility;
        if (has_variance) variance.add(output.variance(x, y), expected[i].variance);
        visibility.add(value, truth);
        worst.add(exact::distance(value, truth), [&, at = checked[i]] {
            return joined("pixel (", at.x, ", ", at.y, "), window ", window, ", depth ",
                          input.depth(at.x, at.y), ": ", value, " for ", truth.high);
        });
    }
    const auto count = [&](const auto& is_so) {
        return static_cast<double>(std::count_if(clean.begin(), clean.end(), is_so));
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    Worst poison;
    for (const Point& at : clean)
        if (any_output(output, [&](const auto& image) { return std::isnan(image(at.x, at.y)); }))
            poison.add(nan, [&] {
                return joined("pixel (", at.x, ", ", at.y, "), window ", window, ", depth ",
                              input.depth(at.x, at.y), ": variance ",
                              has_variance ? output.variance(at.x, at.y) : nan, ", visibility ",
                              output.visibility(at.x, at.y));
            });
    std::optional<double> changed;
    if (input.healthy.width() > 0) {
        const DepthOutput before = algorithm.run(input.healthy, window);
        const auto differs = [](double a, double b) {
            return std::bit_cast<std::uint64_t>(a) != std::bit_cast<std::uint64_t>(b);
        };
        changed = count([&](const Point& at) {
            const auto [x, y] = at;
            return (has_variance && differs(output.variance(x, y), before.variance(x, y))) ||
                   differs(output.visibility(x, y), before.visibility(x, y));
        });
    }
    Row row{subject.label.name,
            algorithm.label.name,
            {{"window", window}, {"windows", clean.size()}, {"exact_windows", checked.size()}},
            {variance.relative(), variance.ulps(), visibility.absolute(), visibility.ulps(),
             poison.nans(), changed}};
    set_worst(row, 4, poison, 4);
    set_worst(row, 2, worst, 4);
    return row;
}

}  // namespace

Family depth_filters(const Options& options)
{
    Family family;
    family.label = {"depth-filters", "Chebyshev AO without bias on " + std::to_string(width) +
                                         " x " + std::to_string(height) +
                                         " depths; clean windows hold no poison, and up to " +
                                         std::to_string(most_exact) +
                                         " per row are compared with exact integers"};
    family.metrics = {
        {"variance", "largest relative error of the variance; inf: a variance where there is none"},
        {"variance_ulps", "largest error of the variance in ulps of the output's type"},
        {"visibility", "largest error of the visibility"},
        {"visibility_ulps", "largest error of the visibility in ulps of the output's type"},
        {"nan", "clean windows with a NaN, of all"},
        {"changed", "clean windows that the poison changes by a bit or more, of all"},
    };
    const std::vector<DepthCase> cases = depth_cases();
    const std::vector<DepthAlgorithm> algorithms = depth_algorithms();
    for (const DepthCase& subject : cases) family.cases.push_back(subject.label);
    for (const DepthAlgorithm& algorithm : algorithms) family.algorithms.push_back(algorithm.label);
    for (const DepthCase& subject : cases)
        for (const int window : options.windows) {
            const DepthInput input = subject.make(window);
            const std::vector<Point> clean = clean_pixels(input, window / 2);
            const std::vector<Point> checked = exact_pixels(input, clean);
            std::vector<exact::Window> expected;
            for (const auto& [x, y] : checked)
                expected.push_back(exact::window(input.depth.view(), x, y, window / 2));
            for (const DepthAlgorithm& algorithm : algorithms)
                family.rows.push_back(
                    measure(subject, algorithm, input, window, clean, checked, expected));
        }
    return family;
}

}  // namespace stability
