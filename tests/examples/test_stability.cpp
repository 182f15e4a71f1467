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
#include "../../examples/stability/worst.hpp"
#include "stability_rows.hpp"

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

// --- the worst inputs -------------------------------------------------------------------------------

TEST_CASE("a text of pieces holds numbers with as many digits as float or double need")
{
    CHECK(stability::joined("pixel (", 3, ", ", std::size_t{4}, "): ", 0.1f, " for ", 0.1) ==
          "pixel (3, 4): 0.1 for 0.1");
    CHECK(stability::joined(double{0.1f}) == "0.10000000149011612");
    CHECK(stability::joined(0.1 + 0.2) == "0.30000000000000004");
    CHECK(stability::joined(1e300, " ", -infinity, " ", std::nan("")) == "1e+300 -inf NaN");
    CHECK(stability::joined().empty());
}

TEST_CASE("the worst is the largest value or the first NaN, and its text is made when it is needed")
{
    stability::Worst worst;
    int texts = 0;
    const auto add = [&](double value, const char* text) {
        worst.add(value, [&] {
            ++texts;
            return std::string{text};
        });
    };
    add(0, "nothing");
    CHECK(worst.input().empty());
    add(2, "two");
    add(1, "one");
    add(2, "two again");
    CHECK(worst.value() == 2);
    CHECK(worst.input() == "two");
    CHECK(texts == 1);
    add(std::nan(""), "NaN");
    add(infinity, "infinity");
    add(std::nan(""), "NaN again");
    CHECK(std::isnan(worst.value()));
    CHECK(worst.input() == "NaN");
    CHECK(worst.nans() == 2);
    CHECK(texts == 2);

    stability::Row row{"case", "algorithm", {}, {}};
    stability::set_worst(row, 3, stability::Worst{}, 7);
    CHECK(row.worst.empty());
    stability::set_worst(row, 4, worst, 7);
    CHECK(row.worst == "NaN");
    CHECK(row.worst_metric == 7);
    stability::Worst other;
    other.add(5, [] { return std::string{"other"}; });
    stability::set_worst(row, 1, other, 7);
    CHECK(row.worst == "NaN");
}

TEST_CASE("a worst pixel, filtered again, gives the error of its row")
{
    stability_rows::check_worst(results());
    const auto cases = stability::depth_cases();
    const auto algorithms = stability::depth_algorithms();
    int reproduced = 0;
    for (const stability::Row& row : results().rows) {
        const int window = row.parameters["window"].get<int>();
        if (row.worst.empty() || row.worst_metric != 2 || window != 17) continue;
        CAPTURE(row.case_name);
        CAPTURE(row.algorithm);
        const auto named = [](const auto& list, const std::string& name) {
            return *std::find_if(list.begin(), list.end(),
                                 [&](const auto& entry) { return entry.label.name == name; });
        };
        const stability::DepthInput input = named(cases, row.case_name).make(window);
        const int x = stability_rows::number_after<int>(row.worst, "pixel (");
        const int y = stability_rows::number_after<int>(row.worst, ", ");
        const auto output = named(algorithms, row.algorithm).run(input.depth, window);
        CHECK(stability_rows::number_after<float>(row.worst, "depth ") == input.depth(x, y));
        CHECK(stability_rows::number_after(row.worst, ": ") == output.visibility(x, y));
        const exact::Window window_there = exact::window(input.depth.view(), x, y, window / 2);
        CHECK(exact::distance(output.visibility(x, y), window_there.visibility) == *row.values[2]);
        ++reproduced;
    }
    CHECK(reproduced >= 150);
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
        const std::string& about = results().metrics[row.worst_metric].name;
        REQUIRE(entry["worst"] == (row.worst.empty() ? "" : about + ": " + row.worst));
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

TEST_CASE("below a table stand the worst cases and inputs of nook's algorithms, and of no others")
{
    stability::Family family;
    family.label = {"family", "what"};
    family.metrics = {{"error", "how far off"}, {"nan", "how many"}};
    family.cases = {{"easy", "an easy one"}, {"difficult", "another"}};
    family.algorithms = {{"textbook", "bad"}, {"nook", "good"}, {"nook-faces", "better"}};
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    family.rows = {{"easy", "textbook", {}, {0.5, 0.}, "pixel 1", 0},
                   {"easy", "nook", {}, {0.25, 0.}, "pixel 2", 0},
                   {"difficult", "nook", {}, {0.5, 0.}, "pixel 3", 0},
                   {"difficult", "nook", {}, {0.125, 0.}, "pixel 4", 0},
                   {"easy", "nook-faces", {}, {nan, 2.}, "pixel 5", 1},
                   {"difficult", "nook-faces", {}, {0., 0.}}};
    std::ostringstream out;
    stability::print_tables(out, {family});
    const std::string text = out.str();
    const auto at = text.find("error: how far off");
    REQUIRE(at != std::string::npos);
    CHECK(text.substr(at) ==
          "error: how far off\n"
          "                                   nook\n"
          "             textbook     nook    faces\n"
          "  easy            0.5     0.25      NaN\n"
          "  difficult         -      0.5        0\n"
          "  nook at its worst, difficult: pixel 3\n"
          "\n"
          "nan: how many\n"
          "                                   nook\n"
          "             textbook     nook    faces\n"
          "  easy              0        0        2\n"
          "  difficult         -        0        0\n"
          "  nook-faces at its worst, easy: pixel 5\n"
          "\n");
}
