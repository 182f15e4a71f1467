#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <nook/measure/ssim.hpp>
#include <nook/owned_image.hpp>
#include <nook/thread_executor.hpp>

#include "../../examples/report/errors.hpp"
#include "../../examples/support/failure.hpp"

namespace {

using nook::Image;
using report::Json;

constexpr float poison = std::numeric_limits<float>::quiet_NaN();

/// A view in which a column in seven is sky.
report::View striped_view(int width, int height)
{
    report::View view;
    view.depth = {width, height, 1.0f};
    view.surface = {width, height, 1};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; x += 7) {
            view.surface(x, y) = 0;
            ++view.background;
        }
    return view;
}

/// What a scene traced would be: whole 64ths that differ from pixel to pixel; poison for the sky.
report::Traced traced(const report::View& view)
{
    report::Traced reference;
    reference.visibility = {view.width(), view.height(), poison};
    for (int y = 0; y < view.height(); ++y)
        for (int x = 0; x < view.width(); ++x)
            if (view.surface(x, y) != 0)
                reference.visibility(x, y) = static_cast<float>((5 * x + 3 * y) % 32) / 64;
    return reference;
}

Image<float> raised(Image<float> image, float by)
{
    for (float& pixel : image) pixel += by;
    return image;
}

/// The same plus 1/4 in one row of `row_step`, poison in the others.
report::HeightField height_field(const report::Traced& reference, int row_step)
{
    report::HeightField field;
    field.visibility = raised(reference.visibility, 0.25f);
    field.row_step = row_step;
    for (int y = 0; y < field.visibility.height(); ++y)
        if (!field.computes(y))
            for (int x = 0; x < field.visibility.width(); ++x) field.visibility(x, y) = poison;
    return field;
}

/// A kernel whose slow form is 1/8 above the height field, and which is 1/16 above that. Its slow form
/// poisons the rows that it was not asked for, and notes those that it was.
struct Fake {
    report::Run run;
    std::shared_ptr<std::vector<int>> rows = std::make_shared<std::vector<int>>();

    Fake(const report::Traced& reference, const char* name, double samples)
    {
        run.visibility = raised(reference.visibility, 0.4375f);
        run.kernel.name = name;
        run.kernel.id = std::string{name} + "-8";
        run.kernel.exact_samples = samples;
        run.kernel.exact = [rows = rows, exact = raised(reference.visibility, 0.375f)](
                               const nook::ImageView<float>& visibility, const nook::WorkMap& map,
                               nook::ThreadExecutor&) {
            for (int y = 0; y < visibility.height; ++y) {
                if (map.is_active(0, y)) rows->push_back(y);
                for (int x = 0; x < visibility.width; ++x)
                    visibility(x, y) = map.is_active(x, y) ? exact(x, y) : poison;
            }
            return nook::Outcome{};
        };
    }

    [[nodiscard]] Json errors(const report::View& view, const report::Traced& reference,
                              const report::HeightField* field) const
    {
        nook::ThreadExecutor threads{2};
        Json result;
        report::add_errors(view, run, reference, field, threads, result);
        return result;
    }
};

/// Surface pixels of the rows for which keep(y).
template <class F>
std::uint64_t pixels_in(const report::View& view, const F& keep)
{
    std::uint64_t pixels = 0;
    for (int y = 0; y < view.height(); ++y)
        for (int x = 0; x < view.width(); ++x)
            pixels += keep(y) && view.surface(x, y) != 0 ? 1u : 0u;
    return pixels;
}

}  // namespace

TEST_CASE("the errors of four pixels in a report are those worked out by hand")
{
    Image<float> image{4, 1}, reference{4, 1};
    for (int x = 0; x < 4; ++x) {
        image(x, 0) = std::vector{0.5f, 0.25f, 1.0f, 0.0f}[static_cast<std::size_t>(x)];
        reference(x, 0) = std::vector{0.25f, 0.75f, 1.0f, 0.0f}[static_cast<std::size_t>(x)];
    }
    nook::ThreadExecutor threads{2};
    const Json error = report::error_of(image.view(), reference.view(), {}, threads);
    CHECK(error["rmse"] == std::sqrt(0.3125 / 4));  // 1/16 + 1/4
    CHECK(error["mae"] == 0.1875);
    CHECK(error["bias"] == -0.0625);
    CHECK(error["p99"] == 0.5);
    CHECK(error["max"] == 0.5);
    CHECK(error["pixels"] == 4);
    // By growing values of the image: 0, 3/4, 1/4, 1. The middle two share 1/2.
    CHECK(error["fitted_rmse"] == std::sqrt(0.125 / 4));
    // The ranks of the first two change places: 1 − 6 · 2 / (4 · 15).
    CHECK(error["rank_correlation"] == 0.8);
    CHECK(error["ssim"] == nook::ssim(image.view(), reference.view()).value);
    CHECK(error["ssim"] < 1.0);

    const Json same = report::error_of(image.view(), image.view(), {}, threads);
    CHECK(same["rmse"] == 0.0);
    CHECK(same["fitted_rmse"] == 0.0);
    CHECK(same["rank_correlation"] == 1.0);
    CHECK(same["ssim"] == 1.0);
}

TEST_CASE(
    "errors of a report are over the pixels that count, and the same with any number of threads")
{
    const report::View view = striped_view(40, 30);
    const report::Traced reference = traced(view);
    Image<float> image = reference.visibility;
    for (int y = 0; y < 30; ++y)
        for (int x = 0; x < 40; ++x) image(x, y) += static_cast<float>((x * y) % 5) / 32;
    nook::ThreadExecutor one{1}, three{3};
    const auto error = [&](nook::ThreadExecutor& threads) {
        return report::error_of(image.view(), reference.visibility.view(), view.surface.view(),
                                threads);
    };
    CHECK(error(one) == error(three));
    CHECK(error(one)["pixels"] == pixels_in(view, [](int) { return true; }));
    CHECK(error(one)["max"] == 0.125);
    CHECK(error(one)["fitted_rmse"] > 0.0);
    CHECK(error(one)["fitted_rmse"] < error(one)["rmse"]);
    // Where nothing counts, everything is at its best, or says nothing.
    const Image<std::uint8_t> nothing{40, 30, 0};
    const Json none =
        report::error_of(image.view(), reference.visibility.view(), nothing.view(), three);
    CHECK(none["pixels"] == 0);
    CHECK(none["rmse"] == 0.0);
    CHECK(none["fitted_rmse"] == 0.0);
    CHECK(none["ssim"] == 1.0);
    CHECK(none["rank_correlation"] == 0.0);
}

TEST_CASE("images that cannot be compared in a report are a failure")
{
    nook::ThreadExecutor threads{2};
    const Image<float> image{4, 4, 0.5f}, wide{5, 4, 0.5f}, poisoned{4, 4, poison};
    CHECK_THROWS_AS((void)report::error_of(image.view(), wide.view(), {}, threads),
                    support::Failure);
    CHECK_THROWS_WITH_AS((void)report::error_of(poisoned.view(), image.view(), {}, threads),
                         doctest::Contains("image"), support::Failure);
}

TEST_CASE("an error splits into what the height field, the estimator and the code make of it")
{
    const report::View view = striped_view(50, 40);
    const report::Traced reference = traced(view);
    for (const int row_step : {1, 3}) {
        const report::HeightField field = height_field(reference, row_step);
        const Fake fake{reference, "alchemy", 8};
        const Json result = fake.errors(view, reference, &field);
        const auto all = pixels_in(view, [](int) { return true; });
        const auto known = pixels_in(view, [&](int y) { return field.computes(y); });
        CHECK(result["error"]["bias"] == 0.4375);
        CHECK(result["error"]["pixels"] == all);
        CHECK(result["error"]["fitted_rmse"] == 0.0);
        CHECK(result["error"]["rank_correlation"] == 1.0);
        CHECK(result["height_field_error"]["bias"] == 0.1875);
        CHECK(result["height_field_error"]["pixels"] == known);
        CHECK(result["estimator_error"]["bias"] == 0.125);
        CHECK(result["estimator_error"]["rmse"] == 0.125);
        CHECK(result["estimator_error"]["pixels"] == known);
        CHECK(result["own_error"]["bias"] == 0.0625);
        CHECK(result["own_error"]["max"] == 0.0625);
        CHECK(result["own_error"]["pixels"] == known);
        for (const int y : *fake.rows) CHECK(field.computes(y));
    }
}

TEST_CASE("terms of the split that say nothing are null")
{
    const report::View view = striped_view(30, 20);
    const report::Traced reference = traced(view);
    const report::HeightField field = height_field(reference, 1);
    SUBCASE("without a height field")
    {
        const Json result = Fake{reference, "horizon", 8}.errors(view, reference, nullptr);
        CHECK(result["height_field_error"].is_null());
        CHECK(result["estimator_error"].is_null());
        CHECK(result["own_error"]["bias"] == 0.0625);
    }
    SUBCASE("for kernels that see the triangles, and those that nobody knows")
    {
        for (const char* name : {"traced", "masked", "information-visibility", "somebody's"}) {
            const Json result = Fake{reference, name, 8}.errors(view, reference, &field);
            CHECK(result["height_field_error"].is_null());
            CHECK(result["estimator_error"].is_null());
            CHECK(result["own_error"]["bias"] == 0.0625);
        }
    }
    SUBCASE("for other meanings than the height field's")
    {
        Fake fake{reference, "alchemy", 8};
        fake.run.kernel.meaning = report::Meaning::obscurance;
        CHECK(fake.errors(view, reference, &field)["height_field_error"].is_null());
    }
    SUBCASE("for kernels without a slow form")
    {
        for (const char* name : {"alchemy-blurred", "alchemy-half", "chebyshev-range-exact"}) {
            Fake fake{reference, name, 8};
            fake.run.kernel.exact = nullptr;
            const Json result = fake.errors(view, reference, &field);
            CHECK(result["height_field_error"]["bias"] == 0.1875);
            CHECK(result["estimator_error"].is_null());
            CHECK(result["own_error"].is_null());
        }
    }
    SUBCASE("where there is nothing to see")
    {
        report::View empty = view;
        for (std::uint8_t& pixel : empty.surface) pixel = 0;
        const Json result = Fake{reference, "alchemy", 8}.errors(empty, reference, &field);
        CHECK(result["error"]["pixels"] == 0);
        CHECK(result["height_field_error"].is_null());
        CHECK(result["estimator_error"].is_null());
        CHECK(result["own_error"].is_null());
    }
}

TEST_CASE(
    "a slow form is computed within a budget, in rows from all over the view, four at the least")
{
    const report::View view = striped_view(64, 120);
    const report::Traced reference = traced(view);
    const auto rows_of = [&](double samples, const report::HeightField* field) {
        const Fake fake{reference, "chebyshev-window", samples};
        const Json result = fake.errors(view, reference, field);
        CHECK(result["own_error"]["bias"] == 0.0625);
        CHECK(result["own_error"]["pixels"] == pixels_in(view, [&](int y) {
                  return std::find(fake.rows->begin(), fake.rows->end(), y) != fake.rows->end();
              }));
        return *fake.rows;
    };
    const double surface = double(pixels_in(view, [](int) { return true; }));
    CHECK(rows_of(1, nullptr).size() == 120);
    CHECK(rows_of(0.9 * 5e6 / surface, nullptr).size() == 120);
    for (const double times : {2.0, 5.0, 12.0}) {
        const auto rows = rows_of((times - 0.5) * 5e6 / surface, nullptr);
        CHECK(double(rows.size()) == 120 / times);
        CHECK(rows.front() == static_cast<int>(times / 2));
        CHECK(rows.back() >= 120 - times);
    }
    CHECK(rows_of(1e12, nullptr).size() == 4);
    const report::HeightField field = height_field(reference, 6);
    const auto rows = rows_of(4.5 * 5e6 / surface * 6, &field);  // of 20 rows one in five
    CHECK(rows.size() == 4);
    for (const int y : rows) CHECK(field.computes(y));
}

TEST_CASE("rows that a slow kernel leaves out do not count in its errors")
{
    const report::View view = striped_view(30, 40);
    const report::Traced reference = traced(view);
    const report::HeightField field = height_field(reference, 1);
    Fake fake{reference, "chebyshev-range-exact", 8};
    fake.run.kernel.row_step = 4;
    for (int y = 0; y < 40; ++y)
        if (!fake.run.kernel.computes(y))
            for (int x = 0; x < 30; ++x) fake.run.visibility(x, y) = 1;
    const auto computed = pixels_in(view, [&](int y) { return fake.run.kernel.computes(y); });
    const Json result = fake.errors(view, reference, &field);
    CHECK(result["error"]["pixels"] == computed);
    CHECK(result["error"]["max"] == 0.4375);
    CHECK(result["height_field_error"]["pixels"] == computed);
    CHECK(result["own_error"]["max"] == 0.0625);
    for (const int y : *fake.rows) CHECK(fake.run.kernel.computes(y));
}

TEST_CASE("a slow form that fails is a failure that names its kernel")
{
    const report::View view = striped_view(30, 20);
    const report::Traced reference = traced(view);
    Fake fake{reference, "alchemy", 8};
    fake.run.kernel.exact = [](const nook::ImageView<float>&, const nook::WorkMap&,
                               nook::ThreadExecutor&) {
        return nook::Outcome{{nook::ErrorCode::bad_value, "options.radius", -1, "> 0"}, {}};
    };
    CHECK_THROWS_WITH_AS((void)fake.errors(view, reference, nullptr),
                         "alchemy-8, its slow form: options.radius is -1; allowed: > 0",
                         support::Failure);
}
