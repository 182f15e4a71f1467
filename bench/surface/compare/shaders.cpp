#include "parts.hpp"

#include <cmath>
#include <cstdio>

#include "common.hpp"
#include "compare/pinned.hpp"
#include "llvmpipe.hpp"

namespace compare {

namespace {

constexpr ShaderPattern patterns[] = {ShaderPattern::shared, ShaderPattern::row,
                                      ShaderPattern::pixel};
constexpr const char* names[] = {"llvmpipe, one pattern", "llvmpipe, a pattern per row",
                                 "llvmpipe, a pattern per pixel"};

class Contest {
public:
    Contest(const Picture& picture, const Options& options, Results& results)
        : picture_{picture},
          options_{options},
          results_{results},
          shaders_{picture}
    {}

    void run(Mark& mark)
    {
        std::vector<std::vector<std::string>> rows{
            {"", "ns per pixel", "over nook's", "nook's, a pattern per pixel"}};
        for (const int samples : {4, 8, 16}) {
            std::vector<Contender> contenders;
            Job job = picture_.job();
            job.visibility = out_.view();
            for (const auto pattern : {nook::SamplePattern::row, nook::SamplePattern::pixel}) {
                nook::AlchemyOptions own = alchemy(picture_, samples);
                own.pattern = pattern;
                contenders.push_back(nook_contender(
                    pattern == nook::SamplePattern::row ? "nook" : "nook, a pattern per pixel", job,
                    [own, run = best_.alchemy_ao](const Job& at) { return run(at, own); }));
            }
            for (std::size_t i = 0; i < 3; ++i) {
                const unsigned program = shaders_.compile(alchemy(picture_, samples), patterns[i]);
                contenders.push_back({names[i], [this, program] { shaders_.draw(program); }});
            }
            const Times times{contenders, effort(options_)};
            for (std::size_t i = 0; i < contenders.size(); ++i) {
                Measurement m = measured("llvmpipe", picture_, contenders, times, i, 0);
                m.samples = samples;
                rows.push_back({std::to_string(samples) + " samples, " + m.contender,
                                text_of(m.nanoseconds), text_of(m.ratio),
                                text_of(times.ratio(i, 1))});
                results_.measurements.push_back(m);
                // The fastest of its shaders is what counts.
                if (i >= 2)
                    mark.take(m.ratio, picture_.name + ", " + std::to_string(samples) + " samples");
            }
        }
        std::printf("%s: one core, nook %s\n", picture_.name.c_str(), best_.name);
        print_table(rows);
    }

    /// Against the plain loop, which takes the same samples; throws when they are not the same.
    [[nodiscard]] std::vector<Agreement> agreements()
    {
        std::vector<Agreement> result;
        nook::AlchemyOptions options = alike(picture_, 16);
        Workspace workspace;
        Job job = picture_.job();
        job.visibility = out_.view();
        job.workspace = &workspace;
        const auto add = [&](const char* other, const nook::Image<float>& one, std::size_t i) {
            Agreement agreement = difference(picture_, one, out_);
            agreement.part = "llvmpipe";
            agreement.contender = names[i];
            agreement.other = other;
            agreement.samples = options.samples;
            result.push_back(agreement);
            return agreement;
        };
        for (std::size_t i = 0; i < 3; ++i) {
            shaders_.draw(shaders_.compile(options, patterns[i]));
            const nook::Image<float> drawn = shaders_.read();
            if (patterns[i] != ShaderPattern::shared) {
                options.pattern = patterns[i] == ShaderPattern::row ? nook::SamplePattern::row
                                                                    : nook::SamplePattern::pixel;
                best_.textbook_ao(job, options);
                const Agreement same = add("scalar", drawn, i);
                if (std::fabs(same.mean) > 1e-3 || same.share > 0.05) refuse(same);
            }
            options.pattern = nook::SamplePattern::row;
            (void)checked(best_.alchemy_ao(job, options), "alchemy_ao");
            const Agreement ours = add("nook", drawn, i);
            if (std::fabs(ours.mean) > 1e-2) refuse(ours);
        }
        return result;
    }

private:
    [[noreturn]] static void refuse(const Agreement& agreement)
    {
        throw Failure{agreement.scene + ": the pictures of " + agreement.contender + " and " +
                      agreement.other + " differ by " + digits("%.4f", agreement.mean) +
                      " on average, " + digits("%.2f", 100 * agreement.share) +
                      " % by more than 0.01"};
    }

    const Picture& picture_;
    const Options& options_;
    Results& results_;
    const Kernels& best_ = targets().best();
    ShaderAo shaders_;
    nook::Image<float> out_{picture_.width(), picture_.height()};
};

}  // namespace

void compare_llvmpipe(const Options& options, const std::vector<Picture>& pictures,
                      Results& results)
{
    Mark mark{"AAO, speed-up over the fastest shader on llvmpipe, one core", true, 6, 12};
    if (llvmpipe_version().empty()) {
        std::printf("llvmpipe: not available\n\n");
        results.marks.push_back(mark);
        return;
    }
    const Pinned pinned;
    std::vector<Agreement> agreements;
    for (const Picture& picture : pictures) {
        Contest contest{picture, options, results};
        for (const Agreement& agreement : contest.agreements()) agreements.push_back(agreement);
        contest.run(mark);
    }
    print_agreements(agreements);
    results.agreements.insert(results.agreements.end(), agreements.begin(), agreements.end());
    results.marks.push_back(mark);
}

}  // namespace compare
