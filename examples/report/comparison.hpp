#pragma once

#include <cstddef>
#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace report {

using Json = nlohmann::ordered_json;

/// Of report.json.
inline constexpr int format = 3;

/// What is still no worse.
struct Tolerances {
    double error = 0.0005;  ///< of RMSE, ≥ 0
    double time = 0.25;     ///< share of the time, ≥ 0
    /// Milliseconds, ≥ 0: a frame that took less longer than expected is within what clocks and the
    /// waking of threads do.
    double least_time = 0.05;
};

/// One result with one number of threads (0 for an error), in both reports.
struct Change {
    std::string cell, result, what;  ///< what: a metric, or "time, N threads"
    int threads = 0;
    double before = 0, now = 0;  ///< of a time: milliseconds
    /// Of a time: now / before, over the median of that over all results with as many threads, so that
    /// another machine does not show; of an error: now − before.
    double change = 0;
};

struct Comparison {
    /// The speed of this machine or day: the median of now / before.
    struct Pace {
        int threads = 1;
        double ratio = 1;
        std::size_t results = 0;  ///< timed with so many threads in both
    };

    /// Beyond the tolerances: errors before times, the largest change first.
    std::vector<Change> worse, better;
    std::vector<std::string> missing;  ///< results of before that are not there now: "cell, result"
    std::size_t compared = 0;          ///< results in both
    std::size_t added = 0;             ///< results of now that were not there before
    std::vector<Pace> paces;           ///< fewer threads first
};

/// What is in a file of JSON. Throws support::Failure, which names it.
[[nodiscard]] Json load_report(const std::filesystem::path& file);

/// Compares RMSE, RMSE after the best monotone fit, the RMSE that leaving out adds, and relative time. As
/// times are compared with what all results took, a change that meets all of them alike is not seen, nor
/// one of the only result.
/// Throws support::Failure, which names the file and the member, for a report of another format, size or
/// reference, and for one that is not of the shape of docs/report.schema.json, as far as it is read.
[[nodiscard]] Comparison compare(const Json& before, const Json& now, const Tolerances& tolerances,
                                 const std::string& old_name);

/// Refuses, before a long run, an old report that `compare` would refuse whatever the run finds. `now` is
/// what is known of the new one: format, run, and cells without references and results.
void check_old_report(const Json& before, const Json& now, const std::string& old_name);

void print(std::ostream& out, const Comparison& comparison, const Tolerances& tolerances);

}  // namespace report
