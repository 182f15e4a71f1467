#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <nook/depth/cantelli.hpp>
#include <nook/depth/moments.hpp>
#include <nook/owned_image.hpp>

#include "../../examples/stability/exact.hpp"
#include "../../examples/stability/stability.hpp"
#include "../../examples/stability/textbook_rays.hpp"

namespace {

namespace exact = stability::exact;
using nook::Image;
using stability::Precision;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr float largest = std::numeric_limits<float>::max();

/// Computed once for all tests of this file.
const stability::Family& results()
{
    static const stability::Family family = stability::depth_filters({});
    return family;
}

struct Errors {
    std::optional<double> variance, variance_ulps, visibility, visibility_ulps, nan, changed;
};
Errors errors(const stability::Row& row)
{
    REQUIRE(row.values.size() == 6);
    const auto& v = row.values;
    return {v[0], v[1], v[2], v[3], v[4], v[5]};
}

/// The errors of an algorithm on a case, for each window.
std::vector<Errors> errors_of(std::string_view subject, std::string_view algorithm)
{
    std::vector<Errors> found;
    for (const stability::Row& row : results().rows)
        if (row.case_name == subject && row.algorithm == algorithm) found.push_back(errors(row));
    REQUIRE(found.size() == 3);
    return found;
}

/// The square of `size` pixels around one at `depth(i, j)`, i and j from its middle.
template <class F>
Image<float> around(int size, const F& depth)
{
    Image<float> image{size, size};
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x)
            image(x, y) = static_cast<float>(depth(x - size / 2, y - size / 2));
    return image;
}
exact::Window middle(const Image<float>& image)
{
    const int radius = image.width() / 2;
    return exact::window(image.view(), radius, radius, radius);
}
/// The oracle as a double.
double rounded(const exact::Wide& value) { return value.high + value.low; }

}  // namespace

// --- the oracle -----------------------------------------------------------------------------------

TEST_CASE("a quotient is good to a hundred bits and more")
{
    for (const int denominator : {1, 3, 7, 81, 4225})
        for (const int numerator : {1, 2, 5, 4224}) {
            const exact::Wide value = exact::quotient(numerator, denominator);
            CHECK(rounded(value) == double(numerator) / denominator);
            // What is left of value · denominator − numerator, without rounding.
            const double rest = std::fma(value.high, denominator, -double(numerator));
            CHECK(std::fabs(std::fma(value.low, denominator, rest)) <= 0x1p-100 * numerator);
        }
    CHECK(rounded(exact::quotient(0, 5)) == 0);
    CHECK(rounded(exact::quotient(3, 4, -10)) == 0.75 / 1024);
    const exact::Integer large = exact::Integer{1} << 600;
    CHECK(rounded(exact::quotient(large + 1, large)) == 1);
    CHECK(exact::quotient(large, large * 3, 1).low != 0);
}

TEST_CASE("the oracle says of small windows what pencil and paper say")
{
    SUBCASE("one of nine pixels a step behind, at any distance and of any step")
    {
        for (const float distance : {0x1p-149f, 0x1p-130f, 1e-25f, 0.1f, 1000.f, 1e30f, 3e38f}) {
            const float behind = std::nextafter(distance, largest);
            const double step = double{behind} - double{distance};
            const exact::Window window = middle(
                around(3, [&](int i, int j) { return i == 0 && j == 0 ? behind : distance; }));
            CHECK(rounded(window.variance) == step * (step * 8) / 81);
            CHECK(rounded(window.visibility) == 1 / 9.0);
        }
    }
    SUBCASE("one of nine pixels in front sees all")
    {
        const exact::Window window =
            middle(around(3, [](int i, int j) { return i == 0 && j == 0 ? 1 : 2; }));
        CHECK(rounded(window.variance) == 8 / 81.0);
        CHECK(rounded(window.visibility) == 1);
    }
    SUBCASE("a spike as far as floats reach beside denormal depths")
    {
        const exact::Window window =
            middle(around(3, [](int i, int j) { return i == 0 && j == 0 ? 0x1p127 : 0x1p-149; }));
        CHECK(rounded(window.variance) == 0x1p254 * 8 / 81);
        CHECK(rounded(window.visibility) == 1 / 9.0);
    }
    SUBCASE("a constant and a plane")
    {
        const exact::Window constant = middle(around(17, [](int, int) { return 0.1f; }));
        CHECK(rounded(constant.variance) == 0);
        CHECK(rounded(constant.visibility) == 1);
        // Σ i² / k over one axis is r (r + 1) / 3.
        const exact::Window plane = middle(around(9, [](int i, int j) { return 100 + 2 * i + j; }));
        CHECK(rounded(plane.variance) == (4 + 1) * 4 * 5 / 3.0);
        CHECK(rounded(plane.visibility) == 1);
    }
    SUBCASE("the bottom of bowls and creases, and the corner of a quadrant")
    {
        const int radii[] = {1, 2, 3, 8, 16};
        const double bowls[] = {1 / 5., 7 / 27., 3 / 11., 19 / 67., 217 / 761.};
        for (int n = 0; n < 5; ++n) {
            const int r = radii[n], k = 2 * r + 1;
            const auto at = [&](const auto& depth) {
                return rounded(middle(around(k, depth)).visibility);
            };
            CHECK(at([](int i, int j) { return 1000 - i * i - j * j; }) == bowls[n]);
            CHECK(at([](int i, int) { return 1000 - std::abs(i); }) ==
                  double(k * k - 3 * r * (r + 1)) / (k * k));
            CHECK(at([](int i, int j) { return i >= 0 && j >= 0 ? 2 : 1; }) ==
                  double((r + 1) * (r + 1)) / (k * k));
        }
    }
}

TEST_CASE("the oracle agrees with the library's own reference on ordinary depths")
{
    std::mt19937 random{5};
    Image<float> image{23, 19};
    for (float& value : image) value = 1 + float(random() % 4096) / 1024;
    Image<double> variance{23, 19}, deviation{23, 19};
    REQUIRE(nook::box_moments_reference(
        image.view(),
        nook::BoxMoments<double>{.variance = variance.view(), .deviation = deviation.view()},
        {.window = 7}));
    for (int y = 3; y < 16; ++y)
        for (int x = 3; x < 20; ++x) {
            const exact::Window window = exact::window(image.view(), x, y, 3);
            REQUIRE(exact::distance(variance(x, y), window.variance) <= 1e-15 * variance(x, y));
            const double visibility =
                nook::cantelli_upper_bound(variance(x, y), deviation(x, y), 0.0);
            REQUIRE(exact::distance(visibility, window.visibility) <= 1e-15);
        }
}

TEST_CASE("errors are told in units of the type that holds the value")
{
    const exact::Wide third = exact::quotient(1, 3);
    // The double below 1/3 lies 2⁻⁵⁴ / 3 away, the next one the rest of a step of 2⁻⁵⁴.
    CHECK(exact::distance(1 / 3.0, third) * 0x1p54 == doctest::Approx(1 / 3.0));
    CHECK(exact::distance(1 / 3.0 + 0x1p-54, third) * 0x1p54 == doctest::Approx(2 / 3.0));
    CHECK(exact::distance(0, third) == doctest::Approx(1 / 3.0));
    CHECK(exact::distance(-infinity, third) == infinity);

    for (const float value : {0.f, 0x1p-149f, 1e-40f, 0x1p-126f, 0.1f, 1.f, 1.9f, 1e30f})
        CHECK(exact::ulp(double{value}, Precision::binary32) ==
              double{std::nextafter(value, 1e38f)} - double{value});
    for (const double value : {0.0, 1e-320, 0x1p-1022, 0.1, 1.0, 1e300})
        CHECK(exact::ulp(value, Precision::binary64) == std::nextafter(value, infinity) - value);

    for (const double value : {0.0, 1.2e-38, 1.0, 3.4e38})
        CHECK(exact::can_hold(value, Precision::binary32));
    for (const double value : {1e-39, 3.5e38, 1e76})
        CHECK_FALSE(exact::can_hold(value, Precision::binary32));
    CHECK(exact::can_hold(1e76, Precision::binary64));
}

// --- the cases ------------------------------------------------------------------------------------

TEST_CASE("poison changes the poisoned pixels alone, and some windows of any size are free of it")
{
    int poisoned = 0;
    for (const stability::DepthCase& subject : stability::depth_cases()) {
        CAPTURE(subject.label.name);
        const stability::DepthInput input = subject.make(17);
        REQUIRE(input.depth.width() == stability::width);
        REQUIRE(input.depth.height() == stability::height);
        if (input.healthy.width() == 0) {
            for (const float value : input.depth) REQUIRE(nook::is_surface(value, largest));
            continue;
        }
        ++poisoned;
        for (int y = 0; y < stability::height; ++y)
            for (int x = 0; x < stability::width; ++x) {
                REQUIRE(nook::is_surface(input.healthy(x, y), largest));
                const bool differs = std::bit_cast<std::uint32_t>(input.depth(x, y)) !=
                                     std::bit_cast<std::uint32_t>(input.healthy(x, y));
                REQUIRE(differs == (input.poisoned(x, y) == 1));
            }
    }
    CHECK(poisoned == 6);
    const stability::Family widest = stability::depth_filters({{stability::largest_window}});
    for (const stability::Row& row : widest.rows) {
        CHECK(row.parameters["windows"] > 100);
        CHECK(row.parameters["exact_windows"] >= 96);
    }
}

TEST_CASE("clean windows are those that hold no poison")
{
    for (const stability::DepthCase& subject : stability::depth_cases()) {
        const std::string& name = subject.label.name;
        if (name != "nan" && name != "sky-infinity" && name != "uniform") continue;
        CAPTURE(name);
        const stability::DepthInput input = subject.make(17);
        int clean = 0;
        for (int y = 8; y < stability::height - 8; ++y)
            for (int x = 8; x < stability::width - 8; ++x) {
                bool holds_poison = false;
                for (int j = y - 8; j <= y + 8; ++j)
                    for (int i = x - 8; i <= x + 8; ++i)
                        holds_poison = holds_poison || !std::isfinite(input.depth(i, j));
                clean += !holds_poison;
            }
        for (const stability::Row& row : results().rows)
            if (row.case_name == name && row.parameters["window"] == 17)
                REQUIRE(row.parameters["windows"] == clean);
    }
}

TEST_CASE("every case meets every algorithm at every window, once")
{
    std::set<std::tuple<std::string, std::string, int>> seen;
    for (const stability::Row& row : results().rows) {
        errors(row);
        CHECK(
            seen.emplace(row.case_name, row.algorithm, row.parameters["window"].get<int>()).second);
    }
    CHECK(seen.size() == 3 * results().cases.size() * results().algorithms.size());
    CHECK(results().rows.size() == seen.size());
    CHECK(results().cases.size() >= 21);
    CHECK(results().algorithms.size() >= 9);
}

// --- what the table shows -------------------------------------------------------------------------

TEST_CASE("nook in float: variance within 8 ulps, no NaN, and poison stays where it is")
{
    for (const stability::Label& subject : results().cases)
        for (const Errors& error : errors_of(subject.name, "nook-float")) {
            CAPTURE(subject.name);
            // Variances that no float can hold are left to the visibility.
            if (error.variance_ulps) CHECK(*error.variance_ulps <= 8);
            else
                CHECK((subject.name == "tiny" || subject.name == "denormal" ||
                       subject.name == "depth-3e38"));
            CHECK(*error.visibility <= 4 * 0x1p-24);
            CHECK(*error.nan == 0);
            if (error.changed) CHECK(*error.changed == 0);
        }
}

TEST_CASE("nook in double: thirteen digits of the variance, and a bound on adversaries")
{
    for (const char* algorithm : {"nook-double", "nook-separable"})
        for (const stability::Label& subject : results().cases) {
            CAPTURE(subject.name);
            const bool adversary = subject.name.starts_with("spikes");
            // To first order (2 k + 6) k units of 2⁻⁵³; k = 65.
            const double bound = adversary ? (2 * 65 + 6) * 65 * 0x1p-53 : 1e-13;
            for (const Errors& error : errors_of(subject.name, algorithm)) {
                CHECK(*error.variance <= bound);
                CHECK(*error.visibility <= bound);
                CHECK(*error.nan == 0);
                if (error.changed) CHECK(*error.changed == 0);
            }
        }
}

TEST_CASE("nook with windows that follow depth: the certified error, no NaN, no spread of poison")
{
    for (const stability::Label& subject : results().cases)
        for (const Errors& error : errors_of(subject.name, "nook-variable")) {
            CAPTURE(subject.name);
            CHECK_FALSE(error.variance);
            CHECK(*error.visibility <= 1e-5);
            CHECK(*error.nan == 0);
            // What is no surface never enters a table; a spike may move the last bits.
            const bool masked = subject.name == "nan" || subject.name.ends_with("infinity");
            if (masked) CHECK(*error.changed == 0);
        }
}

TEST_CASE("the textbook forms fail where the theory says so")
{
    const auto worst = [](const char* subject, const char* algorithm, auto metric) {
        double result = 0;
        for (const Errors& error : errors_of(subject, algorithm)) {
            const std::optional<double> value = error.*metric;
            REQUIRE(value);
            result = std::isnan(*value) ? infinity : std::max(result, *value);
        }
        return result;
    };
    // κ² u: relief 1e-3 at 1e3 leaves float nothing, and double four digits.
    CHECK(worst("depth-1e3", "naive-float", &Errors::variance) > 1e3);
    CHECK(worst("depth-1e3", "naive-float", &Errors::visibility) > 0.5);
    CHECK(worst("depth-1e3", "textbook-float", &Errors::visibility) > 0.5);
    CHECK(worst("depth-1e3", "naive-double", &Errors::variance) > 1e-5);
    CHECK(worst("depth-1e3", "sat-double", &Errors::variance) > 1e-3);
    CHECK(worst("depth-1e5", "naive-double", &Errors::visibility) > 0.05);
    CHECK(worst("depth-1e5", "running-double", &Errors::visibility) > 0.05);
    // A pivot for the whole image helps where all depths are alike, and harms where they are not.
    CHECK(worst("depth-1e3", "sat-pivot", &Errors::variance) < 1e-10);
    CHECK(worst("reversed-z", "sat-pivot", &Errors::variance) >
          1e4 * worst("reversed-z", "sat-double", &Errors::variance));
    // Squares leave the range of float.
    CHECK(worst("depth-3e38", "naive-float", &Errors::nan) > 0);
    CHECK(worst("denormal", "naive-float", &Errors::visibility) > 0.5);
    // What a running sum or a table has met, it keeps; separable sums forget.
    for (const char* poison : {"nan", "infinity", "minus-infinity", "sky-infinity"}) {
        CAPTURE(poison);
        for (const char* algorithm :
             {"running-float", "running-double", "sat-double", "sat-pivot"}) {
            CHECK(worst(poison, algorithm, &Errors::nan) > 1000);
            CHECK(worst(poison, algorithm, &Errors::changed) > 1000);
        }
        CHECK(worst(poison, "naive-float", &Errors::nan) == 0);
        CHECK(worst(poison, "naive-double", &Errors::changed) == 0);
    }
    for (const char* poison : {"spike", "sky-1e30"})
        for (const char* algorithm : {"running-double", "sat-double", "sat-pivot"})
            CHECK(worst(poison, algorithm, &Errors::variance) > 1e6);
    // On gentle data all of them are sound, so their failures are not mistakes in them.
    for (const stability::Label& algorithm : results().algorithms)
        CHECK(worst("uniform", algorithm.name.c_str(), &Errors::visibility) < 1e-4);
}

// --- rays -----------------------------------------------------------------------------------------

namespace {

namespace textbook = stability::textbook;

/// Computed once for all tests of this file.
const std::vector<stability::Family>& ray_families()
{
    static const std::vector<stability::Family> families{
        stability::watertightness(), stability::self_hits(), stability::falloffs(),
        stability::ray_scales()};
    return families;
}

/// What an algorithm made of a case: the number that the metric of this name says.
double value_of(std::string_view family_name, std::string_view metric, std::string_view subject,
                std::string_view algorithm)
{
    std::optional<double> found;
    for (const stability::Family& family : ray_families())
        for (const stability::Row& row : family.rows)
            for (std::size_t i = 0; i < family.metrics.size(); ++i)
                if (family.label.name == family_name && family.metrics[i].name == metric &&
                    row.case_name == subject && row.algorithm == algorithm)
                    found = row.values.at(i);
    CAPTURE(family_name);
    CAPTURE(subject);
    CAPTURE(algorithm);
    REQUIRE(found);
    return *found;
}

}  // namespace

TEST_CASE("rows of rays: labels for all, each case and algorithm once, a number or NaN in each")
{
    for (const stability::Family& family : ray_families()) {
        CAPTURE(family.label.name);
        const auto has = [](const std::vector<stability::Label>& labels, const std::string& name) {
            return std::count_if(labels.begin(), labels.end(), [&](const stability::Label& label) {
                       return label.name == name && !label.what.empty();
                   }) == 1;
        };
        std::set<std::pair<std::string, std::string>> seen;
        for (const stability::Row& row : family.rows) {
            CHECK(has(family.cases, row.case_name));
            CHECK(has(family.algorithms, row.algorithm));
            CHECK(seen.emplace(row.case_name, row.algorithm).second);
            CHECK_FALSE(row.parameters.empty());
            REQUIRE(row.values.size() == family.metrics.size());
            for (const std::optional<double>& value : row.values) CHECK(value);
        }
        // Only points of a list have no face ids.
        const bool points = family.label.name == "rays-self-hits";
        CHECK(seen.size() == family.cases.size() * family.algorithms.size() - (points ? 3 : 0));
    }
}

TEST_CASE("textbook rays hit what they should on gentle data")
{
    const glm::vec3 a{0, 0, 2}, b{4, 0, 2}, c{0, 4, 2};
    for (const auto& [x, y, hits] : {std::tuple{1.f, 1.f, true},
                                     {0.5f, 3.f, true},
                                     {3.f, 3.f, false},
                                     {-1.f, 1.f, false},
                                     {1.f, -1.f, false}})
        for (const float z : {1.f, -1.f}) {
            const textbook::Ray<float> ray{{0, 0, 0}, {x / 4, y / 4, z / 2}};
            const float expected = hits && z > 0 ? 4 : textbook::miss<float>;
            CHECK(textbook::sheared(ray, a, b, c) == expected);
            CHECK(textbook::moeller_trumbore(ray, a, b, c, 1e-6f) == expected);
        }
    // In the plane of the triangle, and away from it.
    CHECK(textbook::sheared({{0, 0, 2}, {1, 1, 0}}, a, b, c) == textbook::miss<float>);
    CHECK(textbook::moeller_trumbore({{0, 0, 2}, {1, 1, 0}}, a, b, c, 0.f) ==
          textbook::miss<float>);
    const glm::vec3 moved = textbook::ulps_offset({1, -1000, 0.01f}, {0.5f, 1, -1});
    CHECK(moved.x == 1 + 128 * 0x1p-23f);
    CHECK(moved.y == -1000 + 256 * 0x1p-14f);
    CHECK(moved.z == 0.01f - 0x1p-16f);
}

TEST_CASE("no ray of nook leaves a closed mesh, at any scale and far from zero")
{
    for (const stability::Label& subject : ray_families()[0].cases) {
        const auto misses = [&](const char* algorithm) {
            return value_of("rays-watertight", "misses", subject.name, algorithm);
        };
        CHECK(misses("nook") == 0);
        CHECK(misses("mt-float") > 100);
        CHECK(misses("mt-double") > 10);
        CHECK(misses("woop-float") < misses("mt-float"));
    }
    CHECK(value_of("rays-watertight", "misses", "scale-1e-6", "mt-textbook") == 1e5);
}

TEST_CASE("no ray of nook hits the plane it starts from, and starts stay as low as is known")
{
    const auto hits = [](const std::string& subject, const char* algorithm) {
        return value_of("rays-self-hits", "hits", subject, algorithm);
    };
    const auto height = [](const std::string& subject, const char* algorithm) {
        return value_of("rays-self-hits", "height", subject, algorithm);
    };
    for (const auto& [subject, offset] :
         {std::pair{"points-at-0", 0.}, {"points-at-1e3", 1e3}, {"points-at-1e6", 1e6}}) {
        CHECK(hits(subject, "nook") == 0);
        // A point lies off by half an ulp in each coordinate, at most, and is lifted by one.
        CHECK(height(subject, "nook") > 0);
        CHECK(height(subject, "nook") <= 0x1p-22 * (offset + 2));
        CHECK(hits(subject, "no-offset") > 0.3);
    }
    for (const auto& [subject, distance] : {std::pair{"depth-1", 1.},
                                            {"depth-1e3", 1e3},
                                            {"depth-1e5", 1e5},
                                            {"depth-1e5-away", 1e5}}) {
        CHECK(hits(subject, "nook") == 0);
        CHECK(hits(subject, "nook-faces") == 0);
        // A step of the depth and 2⁻¹² of a pixel; 8 edges to a unit. With faces what double rounds.
        CHECK(height(subject, "nook") > 0);
        CHECK(height(subject, "nook") <= 8 * (0x1p-23 * distance + 1.5 * 0x1p-12 / 27));
        CHECK(height(subject, "nook-faces") >= 0);
        CHECK(height(subject, "nook-faces") <= 0x1p-39 * (distance + 4));
        CHECK(hits(subject, "no-offset") > 0.3);
    }
    // An offset of a fixed size is lost far away; one in ulps jumps over what is near, and does not
    // know of the depth.
    CHECK(height("points-at-0", "fixed-1e-4") == doctest::Approx(1e-4).epsilon(0.01));
    CHECK(hits("points-at-0", "fixed-1e-4") == 0);
    CHECK(hits("points-at-1e6", "fixed-1e-4") > 0.3);
    CHECK(hits("points-at-1e6", "waechter-binder") == 0);
    CHECK(height("points-at-1e6", "waechter-binder") > 10);
    CHECK(hits("depth-1e5", "waechter-binder") > 0.3);
}

TEST_CASE("what a ray lets through is good to two ulps, and a miss lets all through")
{
    for (const stability::Label& subject : ray_families()[2].cases)
        CHECK(value_of("rays-falloff", "error", subject.name, "nook") <=
              (subject.name == "miss" ? 0 : 0x1p-52));
    CHECK(value_of("rays-falloff", "error", "hit-1e-9", "naive-float") >= 1);
    CHECK(value_of("rays-falloff", "error", "hit-1e-9", "naive-double") > 1e-9);
    CHECK(value_of("rays-falloff", "error", "hit-1", "naive-double") < 1e-15);
    for (const char* naive : {"naive-float", "naive-double"})
        CHECK(std::isnan(value_of("rays-falloff", "error", "miss", naive)));
}

TEST_CASE(
    "nook's visibility does not depend on the scale, nor on the place but for the points' own")
{
    const auto change = [](const char* subject, const char* algorithm) {
        return value_of("rays-scale", "largest", subject, algorithm);
    };
    const auto mean = [](const char* subject, const char* algorithm) {
        return value_of("rays-scale", "mean", subject, algorithm);
    };
    for (const char* subject : {"scale-2^-20", "scale-2^20"}) {
        CHECK(change(subject, "nook") == 0);
        CHECK(mean(subject, "nook") == 0);
    }
    // Edges move by the rounding of vertices: a ray or two of 256 at some points.
    for (const char* subject : {"scale-1e-6", "scale-1e6", "offset-1e3"}) {
        CHECK(change(subject, "nook") <= 2 / 256.);
        CHECK(mean(subject, "nook") <= 1e-4);
    }
    // Starts are lifted by an eighth of the fence.
    CHECK(change("offset-1e6", "nook") <= 0.08);
    CHECK(mean("offset-1e6", "nook") <= 0.015);
    for (const char* textbook : {"fixed-1e-4", "waechter-binder"}) {
        for (const char* subject :
             {"scale-2^-20", "scale-2^20", "scale-1e-6", "scale-1e6", "offset-1e6"})
            CHECK(mean(subject, textbook) > 0.05);
        CHECK(mean("offset-1e3", textbook) < 0.01);
    }
}

// --- what is written ------------------------------------------------------------------------------

TEST_CASE("JSON holds every row, and null for what is not finite or does not apply")
{
    const nlohmann::ordered_json json = stability::json_of({results()});
    // NaN and infinity would come back as null from a dump, and so go unseen.
    CHECK(nlohmann::ordered_json::parse(json.dump()) == json);
    REQUIRE(json["rows"].size() == results().rows.size());
    REQUIRE(json["families"].size() == 1);
    CHECK(json["families"][0]["cases"].size() == results().cases.size());
    CHECK(json["families"][0]["metrics"].size() == 6);
    int nulls = 0;
    for (std::size_t i = 0; i < json["rows"].size(); ++i) {
        const auto& entry = json["rows"][i];
        const stability::Row& row = results().rows[i];
        REQUIRE(entry["family"] == "depth-filters");
        REQUIRE(entry["case"] == row.case_name);
        REQUIRE(entry["algorithm"] == row.algorithm);
        REQUIRE(entry["metrics"].size() == row.values.size());
        for (std::size_t metric = 0; metric < row.values.size(); ++metric) {
            const auto& value = entry["metrics"][results().metrics[metric].name];
            const bool finite = row.values[metric] && std::isfinite(*row.values[metric]);
            nulls += !finite;
            REQUIRE(value.is_null() == !finite);
            if (finite) REQUIRE(value == *row.values[metric]);
        }
    }
    CHECK(nulls > 0);
}

TEST_CASE("tables show the worst of the windows, in aligned columns")
{
    stability::Family family;
    family.label = {"family", "what"};
    family.metrics = {{"error", "how far off"}, {"lost", "how many"}};
    family.cases = {{"easy", "an easy one"}, {"difficult", "another"}};
    family.algorithms = {{"ours-fast", "good"}, {"theirs", "bad"}};
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    family.rows = {{"easy", "ours-fast", {}, {0.5, std::nullopt}},
                   {"easy", "ours-fast", {}, {1e-9, std::nullopt}},
                   {"easy", "theirs", {}, {nan, std::nullopt}},
                   {"easy", "theirs", {}, {infinity, std::nullopt}},
                   {"difficult", "ours-fast", {}, {0., 0.}},
                   {"difficult", "theirs", {}, {infinity, 123456.}}};
    std::ostringstream out;
    stability::print_tables(out, {family});
    const std::string text = out.str();
    const auto at = text.find("error: how far off");
    REQUIRE(at != std::string::npos);
    CHECK(text.substr(at) ==
          "error: how far off\n"
          "                ours\n"
          "                fast   theirs\n"
          "  easy           0.5      NaN\n"
          "  difficult        0      inf\n"
          "\n"
          "lost: how many\n"
          "                ours\n"
          "                fast   theirs\n"
          "  difficult        0  1.2e+05\n"
          "\n");
}
