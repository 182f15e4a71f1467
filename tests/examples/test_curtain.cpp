#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <nook/scene/flat_land.hpp>

#include "../../examples/curtain/curtain.hpp"
#include "../../examples/support/files.hpp"

namespace {

const curtain::Profile& profile()
{
    static const curtain::Profile result = curtain::run({.directions = 1024, .threads = 2});
    return result;
}

const curtain::Curve& curve(const char* name)
{
    for (const curtain::Curve& c : profile().space)
        if (c.name == name) return c;
    FAIL("no such curve");
    return profile().space.front();
}

}  // namespace

TEST_CASE("the largest fall is from a height to any place farther out")
{
    const auto fall = [](std::vector<double> values) {
        curtain::Curve c{"name", "what"};
        c.values = std::move(values);
        return curtain::largest_fall(c);
    };
    CHECK(fall({}) == 0);
    CHECK(fall({0.5}) == 0);
    CHECK(fall({0, 0.25, 0.5, 0.5, 1}) == 0);
    CHECK(fall({0.75, 0.5, 0.625, 0.25, 1, 0.875}) == 0.5);
    CHECK(fall({0.25, 1, 0.75, 2, 1.5}) == 0.5);
}

TEST_CASE("every curve has a value at every position and a name of its own")
{
    std::set<std::string> names;
    for (const auto& curves : {profile().space, profile().flat_land}) {
        names.clear();
        for (const curtain::Curve& c : curves) {
            CAPTURE(c.name);
            CHECK(names.insert(c.name).second);
            CHECK(c.values.size() == profile().positions.size());
        }
    }
    CHECK(profile().positions.front() == 0);
    CHECK(profile().positions[1] == 0.25);
    CHECK(profile().positions.back() > 25.5);
    for (const curtain::Curve& c : profile().space) CHECK(c.values.back() == 1);
}

TEST_CASE("the curves show the artefact, and that it goes")
{
    const double contrast =
        nook::flat_land_contrast(profile().options.curtain, nook::FlatLandMeasure::space);
    // Five times 0.4 N^(-3/4) for each of two positions.
    constexpr double noise = 2 * 5 * 0.0022;
    CHECK(std::fabs(largest_fall(curve("exact")) - contrast) < 0.001);
    CHECK(std::fabs(largest_fall(curve("traced")) - contrast) < noise);
    CHECK(largest_fall(curve("R/4")) < 0.02 + noise);
    CHECK(largest_fall(curve("R/2")) < noise);
    // The rule: the reach halves as the directions quadruple.
    CHECK(curve("N=4").secondary_radius == 12.5);
    CHECK(curve("N=16").secondary_radius == 6.25);
    CHECK(curve("N=64").secondary_radius == 3.125);
    CHECK(curve("N=4").spread > curve("N=16").spread);
    CHECK(curve("N=16").spread > curve("N=64").spread);
    CHECK(curve("N=64").spread > 0);
    // The mean of small sets is that of one large set.
    for (const auto& [few, many] : {std::pair{"N=4", "R/2"}, std::pair{"N=16", "R/4"}})
        for (std::size_t i = 0; i < profile().positions.size(); ++i)
            CHECK(std::fabs(curve(few).values[i] - curve(many).values[i]) < 5 * 0.5 / 32);
}

TEST_CASE("a curve is the same for any number of threads")
{
    const curtain::Profile alone = curtain::run({.directions = 1024, .threads = 1});
    for (std::size_t i = 0; i < alone.space.size(); ++i)
        CHECK(alone.space[i].values == profile().space[i].values);
}

TEST_CASE("the files and the tables hold what was computed")
{
    const nlohmann::ordered_json json = curtain::json_of(profile());
    CHECK(nlohmann::ordered_json::parse(json.dump()) == json);
    CHECK(json["positions"].size() == profile().positions.size());
    CHECK(json["space"].size() == 7);
    CHECK(json["flat_land"].size() == 4);
    for (const char* family : {"space", "flat_land"})
        for (const auto& c : json[family]) CHECK(c["values"].size() == json["positions"].size());
    CHECK(json["false_maximum"]["angle"]["exists"] == true);

    std::ostringstream out;
    curtain::print_tables(out, profile());
    for (const char* word : {"hangs 5 above the ground", "False maximum, space: at 0.5, 0.1606",
                             "N=64", "largest fall", "spread", "0.9008"}) {
        CAPTURE(word);
        CHECK(out.str().find(word) != std::string::npos);
    }

    const std::filesystem::path file =
        std::filesystem::temp_directory_path() / "nook-test-curtain.png";
    curtain::write_plot(file, profile());
    const std::string bytes = support::read_file(file);
    CHECK(bytes.substr(1, 3) == "PNG");
    CHECK(bytes.size() > 5000);
    std::filesystem::remove(file);
}

TEST_CASE("boxes of other shapes have a profile too")
{
    for (const nook::FlatLandCurtain& box : {nook::FlatLandCurtain{1e-6, 1e-6, 1e6, 1e6},
                                             {1e6, 1e6, 1e-6, 1e-6},
                                             {1e-6, 30, 1, 25},
                                             {100, 3, 2, 4}}) {
        const curtain::Profile other = curtain::run({.curtain = box, .directions = 64});
        CHECK(other.positions.size() > 100);
        CHECK(other.positions.size() < 200);
        for (const curtain::Curve& c : other.space)
            for (const double value : c.values) CHECK((value >= 0 && value <= 1));
        std::ostringstream out;
        curtain::print_tables(out, other);
        CHECK(out.str().find("nan") == std::string::npos);
    }
}
