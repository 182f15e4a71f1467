#include "parts.hpp"

#include <cstdint>
#include <cstdio>
#include <optional>

#include "common.hpp"
#include "images.hpp"
#include "opencv.hpp"

namespace compare {

namespace {

/// Everything that one window at one size is measured with.
struct Field {
    std::vector<Contender> contenders;
    std::vector<std::string> images;  ///< which image a contender reads

    void add(const Contender& contender, const char* image)
    {
        contenders.push_back(contender);
        images.emplace_back(image);
    }
    [[nodiscard]] std::optional<std::size_t> find(const std::string& name) const
    {
        for (std::size_t i = 0; i < contenders.size(); ++i)
            if (contenders[i].name == name) return i;
        return {};
    }
};
// The first three of every field.
constexpr std::size_t nook_finite = 0, nook_sky = 1, nook_holes = 2;

/// There is no fast form beside the default one, which is therefore held to the marks of both.
struct Marks {
    Mark over_boxes{"default form, speed-up over OpenCV boxes", true, 2, 4};
    Mark over_memcpy_first, over_memcpy_second;
    Mark background{"image with background, time over the finite one", false, 1.5, 1.1};
    Mark fast_over_boxes_15{"marks of a fast form: speed-up over OpenCV, k <= 15", true, 3};
    Mark fast_over_boxes_127{"marks of a fast form: speed-up over OpenCV, k <= 127", true, 2.3};
    Mark fast_over_memcpy{"marks of a fast form: time over memcpy", false, 10};
    Mark avx2{"AVX2, time over AVX-512", false, 1.8, 1.2};
    Mark sse2{"SSE2, time over AVX-512", false, 3, 2};

    explicit Marks(const std::vector<Size>& sizes)
        : over_memcpy_first{name(sizes.front()), false, 14, 6},
          over_memcpy_second{name(sizes.back()), false, 8, 3}
    {}
    [[nodiscard]] std::vector<Mark> all() const
    {
        return {over_boxes,
                over_memcpy_first,
                over_memcpy_second,
                background,
                fast_over_boxes_15,
                fast_over_boxes_127,
                fast_over_memcpy,
                avx2,
                sse2};
    }

private:
    [[nodiscard]] static std::string name(const Size& size)
    {
        return std::string{"default form, time over memcpy, "} + size.name;
    }
};

class Contest {
public:
    Contest(const Size& size, const Options& options, Results& results, Marks& marks)
        : size_{size},
          options_{options},
          results_{results},
          marks_{marks}
    {
        const std::size_t entries = (static_cast<std::size_t>(size.width) + 1) *
                                    (static_cast<std::size_t>(size.height) + 1);
        sums_.resize(entries);
        squares_.resize(entries);
        counts_.resize(entries);
        work_.resize(5 * static_cast<std::size_t>(size.width));
    }

    void run()
    {
        std::vector<std::vector<std::string>> time_rows, ratio_rows, gap_rows;
        std::vector<std::string> head{""};
        for (const int window : windows) {
            head.push_back("k = " + std::to_string(window));
            const Field field = make_field(window);
            const std::vector<Agreement> agreements = compare_pictures(field, window);
            const Times times{field.contenders, effort(options_)};
            const std::size_t count = field.contenders.size();
            time_rows.resize(count);
            ratio_rows.resize(count);
            for (std::size_t i = 0; i < count; ++i) {
                const Measurement m{
                    .part = "contenders",
                    .image = field.images[i],
                    .contender = field.contenders[i].name,
                    .width = size_.width,
                    .height = size_.height,
                    .window = window,
                    .nanoseconds = per_pixel(times.seconds(i), size_.pixels()),
                    .base = field.contenders[nook_finite].name,
                    .ratio = times.ratio(i, nook_finite),
                };
                if (time_rows[i].empty()) {
                    time_rows[i].push_back(m.contender);
                    ratio_rows[i].push_back(m.contender);
                }
                time_rows[i].push_back(digits("%.3f", m.nanoseconds.median));
                ratio_rows[i].push_back(text_of(m.ratio));
                results_.measurements.push_back(m);
            }
            gap_rows.resize(agreements.size());
            for (std::size_t i = 0; i < agreements.size(); ++i) {
                if (gap_rows[i].empty()) gap_rows[i].push_back(agreements[i].contender);
                gap_rows[i].push_back(digits("%.1e", agreements[i].largest));
                results_.agreements.push_back(agreements[i]);
            }
            take_marks(field, times, window);
        }
        print("nanoseconds per pixel, medians", head, time_rows);
        print("time over nook's, median and quartiles of the ratios within a round", head,
              ratio_rows);
        std::printf(
            "Sums about zero lose digits of small variances: OpenCV's in float, tables in double\n"
            "as they grow. Images with background are compared with tables that count.\n");
        print("largest difference of visibility from nook's", head, gap_rows);
    }

private:
    [[nodiscard]] Field make_field(int window)
    {
        const Targets all = targets();
        const Kernels& best = all.best();
        const Visibility out = out_.view();
        nook::ChebyshevOptions filter;
        filter.window = window;
        const auto nook = [&](const std::string& name, const Kernels& kernels,
                              const nook::Image<float>& image) {
            return nook_contender(name, kernels, image.view(), out, filter);
        };
        const std::string name = std::string{"nook "} + best.name;
        Field field;
        field.add(nook(name, best, finite_), "finite");
        field.add(nook(name + ", sky", best, sky_), "sky");
        field.add(nook(name + ", holes", best, holed_), "holes");
        for (int i = all.count - 2; i >= 0; --i)
            field.add(nook(std::string{"nook "} + all.kernels[i]->name, *all.kernels[i], finite_),
                      "finite");
        const Depth depth = finite_.view();
        for (const Contender& contender : opencv_contenders(depth, out, window, best))
            field.add(contender, "finite");
        field.add({"summed area table",
                   [=, &best, tables = SumTables{sums_.data(), squares_.data()}] {
                       best.fill_tables(depth, tables);
                       best.shade_tables(depth, tables, window, out);
                   }},
                  "finite");
        field.add(
            {"running sums",
             [=, &best, work = work_.data()] { best.running_sums(depth, window, work, out); }},
            "finite");
        field.add(memcpy_contender(depth, out), "finite");
        return field;
    }

    /// The picture of every contender against one of the same image; memcpy makes none.
    [[nodiscard]] std::vector<Agreement> compare_pictures(const Field& field, int window)
    {
        std::vector<Agreement> result;
        const auto add = [&](std::size_t i, Agreement agreement) {
            agreement.contender = field.contenders[i].name;
            agreement.image = field.images[i];
            agreement.width = size_.width;
            agreement.height = size_.height;
            agreement.window = window;
            result.push_back(agreement);
        };
        field.contenders[nook_finite].run();
        const nook::Image<float> expected = out_;
        for (std::size_t i = nook_holes + 1; i + 1 < field.contenders.size(); ++i) {
            field.contenders[i].run();
            // OpenCV reflects the image where nook's windows shrink.
            const bool reflected = field.contenders[i].name == "OpenCV boxes";
            add(i, difference(out_, expected, reflected ? window / 2 : 0));
        }
        // Background: tables that count what is there, with one pixel per unit everywhere.
        const Kernels& best = targets().best();
        const nook::Projection flat{.fx = 1, .fy = 1, .orthographic = true};
        const SumTables tables{sums_.data(), squares_.data(), counts_.data()};
        for (const std::size_t i : {nook_sky, nook_holes}) {
            const nook::Image<float>& image = i == nook_sky ? sky_ : holed_;
            nook::Image<float> by_tables{size_.width, size_.height};
            best.fill_tables(image.view(), tables);
            best.shade_tables_radius(image.view(), tables, window / 2, window, flat,
                                     by_tables.view());
            field.contenders[i].run();
            add(i, difference(out_, by_tables));
        }
        return result;
    }

    void take_marks(const Field& field, const Times& times, int window)
    {
        const std::string place = std::string{size_.name} + ", k = " + std::to_string(window);
        if (const auto boxes = field.find("OpenCV boxes")) {
            const Summary speed_up = times.ratio(*boxes, nook_finite);
            marks_.over_boxes.take(speed_up, place);
            if (window <= 15) marks_.fast_over_boxes_15.take(speed_up, place);
            marks_.fast_over_boxes_127.take(speed_up, place);
        }
        const Summary over_memcpy = times.ratio(nook_finite, field.contenders.size() - 1);
        const bool first = size_.width == sizes(options_).front().width;
        (first ? marks_.over_memcpy_first : marks_.over_memcpy_second).take(over_memcpy, place);
        marks_.fast_over_memcpy.take(over_memcpy, place);
        marks_.background.take(times.ratio(nook_sky, nook_finite), "sky, " + place);
        marks_.background.take(times.ratio(nook_holes, nook_finite), "holes, " + place);
        if (field.contenders[nook_finite].name != "nook AVX-512") return;
        if (const auto avx2 = field.find("nook AVX2"))
            marks_.avx2.take(times.ratio(*avx2, nook_finite), place);
        if (const auto sse2 = field.find("nook SSE2"))
            marks_.sse2.take(times.ratio(*sse2, nook_finite), place);
    }

    void print(const char* what, const std::vector<std::string>& head,
               std::vector<std::vector<std::string>> rows) const
    {
        std::printf("%s: %s\n", size_.name, what);
        rows.insert(rows.begin(), head);
        print_table(rows);
    }

    Size size_;
    const Options& options_;
    Results& results_;
    Marks& marks_;
    nook::Image<float> finite_ = finite_image(size_.width, size_.height);
    nook::Image<float> sky_ = sky_image(size_.width, size_.height);
    nook::Image<float> holed_ = holed_image(size_.width, size_.height);
    nook::Image<float> out_{size_.width, size_.height};
    std::vector<double> sums_{}, squares_{}, work_{};
    std::vector<std::int32_t> counts_{};
};

}  // namespace

void compare_contenders(const Options& options, Results& results)
{
    Marks marks{sizes(options)};
    for (const Size& size : sizes(options)) Contest{size, options, results, marks}.run();
    for (const Mark& mark : marks.all()) results.marks.push_back(mark);
}

}  // namespace compare
