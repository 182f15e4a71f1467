#include "parts.hpp"

#include <cmath>
#include <cstdio>
#include <optional>

#include "common.hpp"

namespace compare {

namespace {

enum class Kind { row, pixel, scalar, gather };

/// Who runs what for which instruction set.
struct Entrant {
    Kind kind;
    const Kernels* kernels;
};

struct Field {
    std::vector<Contender> contenders;
    std::vector<Entrant> entrants;

    [[nodiscard]] std::optional<std::size_t> find(Kind kind, const Kernels* kernels) const
    {
        for (std::size_t i = 0; i < entrants.size(); ++i)
            if (entrants[i].kind == kind && entrants[i].kernels == kernels) return i;
        return {};
    }
    /// The fastest of a kind, whatever its instruction set.
    [[nodiscard]] std::optional<std::size_t> fastest(Kind kind, const Times& times) const
    {
        std::optional<std::size_t> best;
        for (std::size_t i = 0; i < entrants.size(); ++i)
            if (entrants[i].kind == kind &&
                (!best || times.seconds(i).median < times.seconds(*best).median))
                best = i;
        return best;
    }
};

class Contest {
public:
    Contest(const Picture& picture, const Options& options, Results& results)
        : picture_{picture},
          options_{options},
          results_{results}
    {}

    void run(Mark& over_scalar, Mark& over_gathers)
    {
        std::vector<std::vector<std::string>> rows{{"ns per pixel, and time over nook's",
                                                    "4 samples", "", "8 samples", "", "16 samples",
                                                    ""}};
        for (const int samples : {4, 8, 16}) {
            const Field field = make_field(samples);
            const Times times{field.contenders, effort(options_)};
            add_rows(field, times, samples, rows);
            if (samples < 16) continue;
            if (const auto scalar = field.fastest(Kind::scalar, times))
                over_scalar.take(times.ratio(*scalar, 0), picture_.name);
            if (const auto gathers = field.fastest(Kind::gather, times))
                over_gathers.take(times.ratio(*gathers, 0), picture_.name);
            std::printf("%s: contenders of the same flags, 16 samples\n", picture_.name.c_str());
            print_sets(field, times);
        }
        std::printf("%s: nook %s against all\n", picture_.name.c_str(), best_.name);
        print_table(rows);
    }

    /// How the pictures agree; throws when one of them is not of the same obscurance.
    [[nodiscard]] std::vector<Agreement> agreements() const
    {
        std::vector<Agreement> result;
        const auto draw = [&](auto function, int samples, nook::SamplePattern pattern) {
            nook::Image<float> picture{picture_.width(), picture_.height()};
            nook::AlchemyOptions options = alike(picture_, samples);
            options.pattern = pattern;
            Workspace workspace;
            Job job = picture_.job();
            job.visibility = picture.view();
            job.workspace = &workspace;
            function(job, options);
            return picture;
        };
        const auto nook = [&](const Job& job, const nook::AlchemyOptions& options) {
            (void)checked(best_.alchemy_ao(job, options), "alchemy_ao");
        };
        const auto add = [&](const char* contender, const char* other, int samples,
                             const nook::Image<float>& one, const nook::Image<float>& two,
                             double mean, double share) {
            Agreement agreement = difference(picture_, one, two);
            agreement.part = "aao";
            agreement.contender = contender;
            agreement.other = other;
            agreement.samples = samples;
            result.push_back(agreement);
            if (std::fabs(agreement.mean) > mean || agreement.share > share)
                throw Failure{picture_.name + ": the pictures of " + contender + " and " + other +
                              " differ by " + digits("%.4f", agreement.mean) + " on average, " +
                              digits("%.2f", 100 * agreement.share) + " % by more than 0.01"};
        };
        // What lies on the edge of a pixel is read from either side: two loops may round it apart.
        constexpr double rounding = 0.05;
        for (const int samples : {16, 64}) {
            const auto scalar = draw(best_.textbook_ao, samples, nook::SamplePattern::pixel);
            if (const auto gather = targets().best().gather_ao)
                add("gathers", "scalar", samples, draw(gather, samples, nook::SamplePattern::pixel),
                    scalar, 1e-3, rounding);
            add("nook", "scalar", samples, draw(nook, samples, nook::SamplePattern::row), scalar,
                1e-2, 1);
            add("nook, per pixel", "scalar", samples,
                draw(nook, samples, nook::SamplePattern::pixel), scalar, 1e-2, 1);
        }
        return result;
    }

private:
    [[nodiscard]] Field make_field(int samples)
    {
        const Targets all = targets();
        Field field;
        Job job = picture_.job();
        job.visibility = out_.view();
        const auto add = [&](Kind kind, const Kernels& kernels) {
            nook::AlchemyOptions options = alchemy(picture_, samples);
            const bool ours = kind == Kind::row || kind == Kind::pixel;
            options.pattern =
                kind == Kind::row ? nook::SamplePattern::row : nook::SamplePattern::pixel;
            const char* const names[] = {"nook ", "nook, a pattern per pixel, ", "scalar loop ",
                                         "gathers "};
            const std::string name = std::string{names[static_cast<int>(kind)]} + kernels.name;
            field.entrants.push_back({kind, &kernels});
            if (ours) {
                field.contenders.push_back(nook_contender(
                    name, job,
                    [=, run = kernels.alchemy_ao](const Job& own) { return run(own, options); }));
            } else {
                const auto run = kind == Kind::scalar ? kernels.textbook_ao : kernels.gather_ao;
                field.contenders.push_back({name, [=] { run(job, options); }});
            }
        };
        add(Kind::row, best_);
        add(Kind::pixel, best_);
        for (int i = all.count - 1; i >= 0; --i) {
            const Kernels& kernels = *all.kernels[i];
            const bool best = i == all.count - 1;
            // The whole field once.
            if (!best && samples < 16) continue;
            if (!best) add(Kind::row, kernels);
            add(Kind::scalar, kernels);
            if (kernels.gather_ao != nullptr) add(Kind::gather, kernels);
        }
        return field;
    }

    void add_rows(const Field& field, const Times& times, int samples,
                  std::vector<std::vector<std::string>>& rows)
    {
        for (std::size_t i = 0; i < field.contenders.size(); ++i) {
            Measurement m = measured("aao", picture_, field.contenders, times, i, 0);
            m.samples = samples;
            std::size_t row = 1;
            while (row < rows.size() && rows[row][0] != m.contender) ++row;
            if (row == rows.size()) {
                rows.push_back(std::vector<std::string>(7, "-"));
                rows.back()[0] = m.contender;
            }
            const std::size_t column = samples == 4 ? 1 : samples == 8 ? 3 : 5;
            rows[row][column] = digits("%.2f", m.nanoseconds.median);
            rows[row][column + 1] = text_of(m.ratio);
            results_.measurements.push_back(m);
        }
    }

    void print_sets(const Field& field, const Times& times) const
    {
        std::vector<std::vector<std::string>> rows{
            {"", "nook, ns/px", "over the best set's", "scalar over nook", "gathers over nook"}};
        const Targets all = targets();
        for (int i = all.count - 1; i >= 0; --i) {
            const Kernels* const kernels = all.kernels[i];
            const auto own = field.find(Kind::row, kernels);
            const auto scalar = field.find(Kind::scalar, kernels);
            const auto gather = field.find(Kind::gather, kernels);
            rows.push_back(
                {kernels->name,
                 digits("%.2f", per_pixel(times.seconds(*own), picture_.pixels()).median),
                 text_of(times.ratio(*own, 0)), text_of(times.ratio(*scalar, *own)),
                 gather ? text_of(times.ratio(*gather, *own)) : "none in this set"});
        }
        print_table(rows);
    }

    const Picture& picture_;
    const Options& options_;
    Results& results_;
    const Kernels& best_ = targets().best();
    nook::Image<float> out_{picture_.width(), picture_.height()};
};

}  // namespace

void compare_aao(const Options& options, const std::vector<Picture>& pictures, Results& results)
{
    Mark over_scalar{"AAO, 16 samples, speed-up over the fastest scalar loop", true, 10, 15};
    Mark over_gathers{"AAO, 16 samples, speed-up over the fastest gathers", true, 1.8, 2.5};
    std::vector<Agreement> agreements;
    for (const Picture& picture : pictures) {
        Contest contest{picture, options, results};
        for (const Agreement& agreement : contest.agreements()) agreements.push_back(agreement);
        contest.run(over_scalar, over_gathers);
    }
    print_agreements(agreements);
    std::printf(
        "All with the same bias, intensity and epsilon. The loop and the gathers share places of\n"
        "samples; nook's are others, so that what differs from these is noise.\n\n");
    results.agreements.insert(results.agreements.end(), agreements.begin(), agreements.end());
    results.marks.push_back(over_scalar);
    results.marks.push_back(over_gathers);
}

}  // namespace compare
