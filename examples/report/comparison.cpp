#include "comparison.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <map>
#include <optional>
#include <ostream>
#include <string_view>
#include <utility>

#include <nook/checks.hpp>

#include "../support/failure.hpp"
#include "../support/files.hpp"

namespace report {

namespace {

constexpr const char* new_name = "the new report";

/// Fit for a line of a message, wherever it comes from.
std::string printable(std::string_view text)
{
    std::string result;
    for (const char c : text.substr(0, 80)) result += c >= ' ' && c <= '~' ? c : '?';
    return result + (text.size() > 80 ? "..." : "");
}

/// A value somewhere in a report, that can say where. Every question is answered, or throws
/// support::Failure.
class Member {
public:
    Member(const Json& json, const std::string& file) : json_{&json}, file_{&file} {}

    [[nodiscard]] Member operator[](const char* name) const
    {
        if (!json_->is_object()) fail("is not an object");
        const std::string path = path_.empty() ? name : path_ + '.' + name;
        const auto found = json_->find(name);
        if (found == json_->end()) throw support::Failure{*file_ + ": " + path + " is missing"};
        return {*found, *file_, path};
    }
    [[nodiscard]] std::vector<Member> elements() const
    {
        if (!json_->is_array()) fail("is not an array");
        std::vector<Member> list;
        for (std::size_t i = 0; i < json_->size(); ++i)
            list.push_back({(*json_)[i], *file_, path_ + '[' + std::to_string(i) + ']'});
        return list;
    }
    /// The elements of an array by the text of one of their members, which no two share; their paths
    /// have that text in place of a number.
    [[nodiscard]] std::vector<std::pair<std::string, Member>> elements_by(const char* name) const
    {
        std::vector<std::pair<std::string, Member>> list;
        std::map<std::string, int> seen;
        for (Member& element : elements()) {
            const Member key = element[name];
            std::string text = key.text();
            if (seen[text]++ > 0) key.fail("is there twice: " + key.shown());
            element.path_ = path_ + '[' + printable(text) + ']';
            list.emplace_back(std::move(text), std::move(element));
        }
        return list;
    }

    [[nodiscard]] std::string text() const
    {
        if (!json_->is_string()) fail("is not a text");
        return json_->get<std::string>();
    }
    /// Finite and not negative.
    [[nodiscard]] double amount() const
    {
        const double value = json_->is_number() ? json_->get<double>() : -1;
        if (!nook::detail::is_finite(value) || !(value >= 0)) fail("is not a number from 0");
        return value;
    }
    [[nodiscard]] double number() const
    {
        const double value = json_->is_number() ? json_->get<double>() : NAN;
        if (!nook::detail::is_finite(value)) fail("is not a number");
        return value;
    }
    [[nodiscard]] bool truth() const
    {
        if (!json_->is_boolean()) fail("is neither true nor false");
        return json_->get<bool>();
    }
    [[nodiscard]] int count() const
    {
        constexpr std::int64_t most = 1 << 30;
        const std::int64_t value = json_->is_number_integer() ? json_->get<std::int64_t>() : -1;
        if (value < 0 || value > most) fail("is not a whole number from 0");
        return static_cast<int>(value);
    }
    [[nodiscard]] bool is_null() const { return json_->is_null(); }

    /// Null, numbers and texts, shortened.
    [[nodiscard]] std::string shown() const
    {
        if (json_->is_structured() || json_->is_binary()) return json_->type_name();
        return printable(json_->dump(-1, ' ', false, Json::error_handler_t::replace));
    }
    [[noreturn]] void fail(const std::string& why) const
    {
        throw support::Failure{*file_ + ": " + (path_.empty() ? "" : path_ + ' ') + why};
    }
    /// Refuses what cannot be compared.
    [[noreturn]] void differs(const Member& now) const
    {
        fail("is " + shown() + ", and " + now.shown() + " in " + *now.file_);
    }

private:
    Member(const Json& json, const std::string& file, std::string path)
        : json_{&json},
          file_{&file},
          path_{std::move(path)}
    {}

    const Json* json_;
    const std::string* file_;
    std::string path_;
};

struct Result {
    Member meaning;
    double rmse, fitted_rmse;
    std::optional<double> added_rmse;  ///< by what was left out
    std::map<int, double> times;       ///< milliseconds by number of threads
};

struct Cell {
    Member radius, triangles, camera;
    std::vector<double> view;                  ///< the numbers of the camera
    std::optional<double> limit;               ///< none: unlimited
    std::map<std::string, Member> directions;  ///< by meaning
    std::vector<std::pair<std::string, Result>> results;
    std::map<std::string, std::size_t> places;  ///< in `results`, by id
};

struct Contents {
    std::vector<std::pair<std::string, Cell>> cells;
    std::map<std::string, std::size_t> places;
};

Result result_of(const Member& member)
{
    const Member error = member["error"];
    Result result{member["meaning"], error["rmse"].amount(), error["fitted_rmse"].amount(), {}, {}};
    (void)result.meaning.text();
    if (const Member added = member["added_error"]; !added.is_null())
        result.added_rmse = added["rmse"].amount();
    for (const Member& timing : member["timings"].elements()) {
        const Member threads = timing["threads"];
        if (threads.count() < 1) threads.fail("is not a number of threads");
        if (!result.times.emplace(threads.count(), timing["median"].amount()).second)
            threads.fail("is there twice: " + threads.shown());
    }
    return result;
}

/// What is compared of a report; all of it is checked.
Contents contents_of(const Member& report)
{
    Contents contents;
    for (const auto& [id, member] : report["cells"].elements_by("id")) {
        Cell cell{member["radius"], member["triangles"], member["camera"], {}, {}, {}, {}, {}};
        (void)cell.triangles.count();
        for (const Member& number : cell.camera.elements()) cell.view.push_back(number.number());
        if (!cell.radius.is_null()) cell.limit = cell.radius.amount();
        for (const auto& [meaning, reference] : member["references"].elements_by("meaning")) {
            const Member directions = reference["directions"];
            (void)directions.count();
            cell.directions.emplace(meaning, directions);
        }
        for (const auto& [name, result] : member["results"].elements_by("id")) {
            cell.places.emplace(name, cell.results.size());
            cell.results.emplace_back(name, result_of(result));
        }
        contents.places.emplace(id, contents.cells.size());
        contents.cells.emplace_back(id, std::move(cell));
    }
    return contents;
}

const Result* find(const Cell& cell, const std::string& id)
{
    const auto place = cell.places.find(id);
    return place != cell.places.end() ? &cell.results[place->second].second : nullptr;
}

/// Equal, but for what another machine's last bits do.
bool same_radius(const Cell& a, const Cell& b)
{
    if (!a.limit || !b.limit) return !a.limit && !b.limit;
    return std::abs(*a.limit - *b.limit) <= 1e-6 * *a.limit;
}

bool same_view(const Cell& a, const Cell& b)
{
    if (a.view.size() != b.view.size()) return false;
    for (std::size_t i = 0; i < a.view.size(); ++i)
        if (!(std::abs(a.view[i] - b.view[i]) <= 1e-6 * (1 + std::abs(a.view[i])))) return false;
    return true;
}

void check_comparable(const Member& before, const Member& now)
{
    const Member version = now["format"];
    if (version.count() != format)
        version.fail("is " + version.shown() + ", not " + std::to_string(format));
    if (before["format"].count() != format) before["format"].differs(version);
    for (const char* name : {"width", "height", "directions"})
        if (before["run"][name].count() != now["run"][name].count())
            before["run"][name].differs(now["run"][name]);
    // Settings of one name differ between the two.
    if (before["run"]["quick"].truth() != now["run"]["quick"].truth())
        before["run"]["quick"].differs(now["run"]["quick"]);
}

void check_comparable(const Cell& before, const Cell& now)
{
    if (!same_radius(before, now)) before.radius.differs(now.radius);
    if (before.triangles.count() != now.triangles.count()) before.triangles.differs(now.triangles);
    if (!same_view(before, now)) before.camera.fail("is another than in the new report");
    for (const auto& [meaning, directions] : before.directions) {
        const auto found = now.directions.find(meaning);
        if (found != now.directions.end() && directions.count() != found->second.count())
            directions.differs(found->second);
    }
}

/// A result in both reports.
struct Pair {
    const std::string *cell, *id;
    const Result *before, *now;
};

double median_of(std::vector<double> values)
{
    std::sort(values.begin(), values.end(), [](double a, double b) { return a < b; });
    const std::size_t middle = values.size() / 2;
    return values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
}

void compare_errors(const Pair& pair, double tolerance, Comparison& comparison)
{
    const auto judge = [&](const char* what, double before, double now) {
        const Change change{*pair.cell, *pair.id, what, 0, before, now, now - before};
        if (change.change > tolerance) comparison.worse.push_back(change);
        if (change.change < -tolerance) comparison.better.push_back(change);
    };
    judge("RMSE", pair.before->rmse, pair.now->rmse);
    judge("fitted RMSE", pair.before->fitted_rmse, pair.now->fitted_rmse);
    if (pair.before->added_rmse && pair.now->added_rmse)
        judge("added RMSE", *pair.before->added_rmse, *pair.now->added_rmse);
}

void compare_times(const std::vector<Pair>& pairs, const Tolerances& tolerances,
                   Comparison& comparison)
{
    struct Times {
        const Pair* pair;
        double before, now;
    };
    std::map<int, std::vector<Times>> by_threads;
    for (const Pair& pair : pairs)
        for (const auto& [threads, before] : pair.before->times) {
            const auto now = pair.now->times.find(threads);
            // A clock that saw no time pass says nothing about shares of it.
            if (now != pair.now->times.end() && before > 0 && now->second > 0)
                by_threads[threads].push_back({&pair, before, now->second});
        }

    for (const auto& [threads, all] : by_threads) {
        std::vector<double> ratios;
        for (const Times& times : all) ratios.push_back(times.now / times.before);
        const double pace = median_of(ratios);
        comparison.paces.push_back({threads, pace, all.size()});
        const std::string what =
            "time, " + std::to_string(threads) + (threads == 1 ? " thread" : " threads");
        for (const Times& times : all) {
            const double expected = times.before * pace;
            const Change change{*times.pair->cell, *times.pair->id,     what, threads, times.before,
                                times.now,         times.now / expected};
            if (std::abs(times.now - expected) <= tolerances.least_time) continue;
            if (change.change > 1 + tolerances.time) comparison.worse.push_back(change);
            if (change.change * (1 + tolerances.time) < 1) comparison.better.push_back(change);
        }
    }
}

std::string line(const char* form, double value)
{
    char text[64];
    std::snprintf(text, sizeof text, form, value);
    return text;
}

std::string padded(std::string_view text, std::size_t size)
{
    return std::string{text} + std::string(size > text.size() ? size - text.size() : 0, ' ');
}

void print_changes(std::ostream& out, const char* head, const std::vector<Change>& changes)
{
    if (changes.empty()) return;
    out << head << ": " << changes.size() << '\n';
    std::size_t cells = 0, results = 0, whats = 0;
    for (const Change& change : changes) {
        cells = (std::max)(cells, printable(change.cell).size());
        results = (std::max)(results, printable(change.result).size());
        whats = (std::max)(whats, change.what.size());
    }
    for (const Change& change : changes) {
        out << "  " << padded(printable(change.cell), cells) << "  "
            << padded(printable(change.result), results) << "  " << padded(change.what, whats)
            << "  ";
        if (change.threads == 0)
            out << line("%.5f -> ", change.before) << line("%.5f", change.now)
                << line(" (%+.5f)", change.change);
        else
            out << line("%.4g -> ", change.before) << line("%.4g ms", change.now)
                << line(" (x %.3g relative)", change.change);
        out << '\n';
    }
}

}  // namespace

Json load_report(const std::filesystem::path& file)
{
    const std::string bytes = support::read_file(file, std::uintmax_t{1} << 30);
    try {
        return Json::parse(bytes);
    } catch (const Json::parse_error& error) {
        throw support::Failure{file.string() + ": is no JSON from byte " +
                               std::to_string(error.byte) + " on"};
    } catch (const Json::exception&) {
        throw support::Failure{file.string() + ": holds a number that is too large"};
    }
}

Comparison compare(const Json& before, const Json& now, const Tolerances& tolerances,
                   const std::string& old_name)
{
    const std::string name_now = new_name;
    const Member report_before{before, old_name}, report_now{now, name_now};
    check_comparable(report_before, report_now);
    const Contents old = contents_of(report_before), fresh = contents_of(report_now);

    Comparison comparison;
    std::vector<Pair> pairs;
    for (const auto& [id, cell] : old.cells) {
        const auto place = fresh.places.find(id);
        const Cell* same_cell =
            place != fresh.places.end() ? &fresh.cells[place->second].second : nullptr;
        if (same_cell != nullptr) check_comparable(cell, *same_cell);
        for (const auto& [name, result] : cell.results) {
            const Result* same = same_cell != nullptr ? find(*same_cell, name) : nullptr;
            if (same == nullptr) {
                comparison.missing.push_back(id + ", " + name);
                continue;
            }
            if (result.meaning.text() != same->meaning.text())
                result.meaning.differs(same->meaning);
            pairs.push_back({&id, &name, &result, same});
        }
    }
    comparison.compared = pairs.size();
    for (const auto& [id, cell] : fresh.cells) comparison.added += cell.results.size();
    comparison.added -= pairs.size();

    for (const Pair& pair : pairs) compare_errors(pair, tolerances.error, comparison);
    compare_times(pairs, tolerances, comparison);
    const auto sort = [](std::vector<Change>& changes, bool largest) {
        std::stable_sort(changes.begin(), changes.end(), [&](const Change& a, const Change& b) {
            if ((a.threads == 0) != (b.threads == 0)) return a.threads == 0;
            return largest ? a.change > b.change : a.change < b.change;
        });
    };
    sort(comparison.worse, true);
    sort(comparison.better, false);
    return comparison;
}

void check_old_report(const Json& before, const Json& now, const std::string& old_name)
{
    (void)compare(before, now, {}, old_name);
}

void print(std::ostream& out, const Comparison& comparison, const Tolerances& tolerances)
{
    print_changes(out, "worse", comparison.worse);
    print_changes(out, "better", comparison.better);
    constexpr std::size_t listed = 20;
    if (!comparison.missing.empty()) out << "missing: " << comparison.missing.size() << '\n';
    for (std::size_t i = 0; i < (std::min)(listed, comparison.missing.size()); ++i)
        out << "  " << printable(comparison.missing[i]) << '\n';
    if (comparison.missing.size() > listed)
        out << "  and " << comparison.missing.size() - listed << " more\n";

    out << comparison.compared << " results compared: " << comparison.worse.size()
        << " changes for the worse, " << comparison.better.size() << " for the better; "
        << comparison.missing.size() << " missing, " << comparison.added << " new.\n"
        << line("An error may grow by %g", tolerances.error)
        << line(", a time by %g %%", 100 * tolerances.time)
        << line(" and %g ms, relative to the median over all results:\n", tolerances.least_time);
    for (const Comparison::Pace& pace : comparison.paces)
        out << "  " << pace.threads << (pace.threads == 1 ? " thread: " : " threads: ")
            << line("x %.3g", pace.ratio) << " over " << pace.results << " results\n";
    if (comparison.paces.empty()) out << "  no times to compare\n";
    out << "so another machine or a slower day does not show, and nor does a slow-down of "
           "everything.\n";
}

}  // namespace report
