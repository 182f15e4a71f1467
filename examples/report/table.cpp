#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <ostream>
#include <string_view>
#include <utility>

#include "document.hpp"

namespace report {

namespace {

constexpr std::size_t columns = 100;

template <class... Values>
std::string line(const char* format, Values... values)
{
    char text[256];
    std::snprintf(text, sizeof text, format, values...);
    return text;
}

std::string text_of(const Json& name) { return name.get<std::string>(); }
double number(const Json& value) { return value.get<double>(); }

std::string padded(std::string_view text, std::size_t size)
{
    return std::string{text} + std::string(size > text.size() ? size - text.size() : 0, ' ');
}

/// Places on the screen: bytes that begin a character of UTF-8.
std::size_t width_of(std::string_view text)
{
    return std::size_t(std::count_if(text.begin(), text.end(), [](char c) {
        return (static_cast<unsigned char>(c) & 0xc0) != 0x80;
    }));
}

/// Breaks the text at its spaces. Lines after the first begin with `indent` of them.
void print_wrapped(std::ostream& out, std::string_view text, std::size_t indent)
{
    std::size_t used = 0;
    bool first = true;
    while (!text.empty()) {
        const std::string_view word = text.substr(0, text.find(' ', 1));
        text.remove_prefix(word.size());
        if (!first && used + width_of(word) > columns) {
            out << '\n' << std::string(indent, ' ');
            used = indent;
            out << word.substr(1);
            used += width_of(word) - 1;
        } else {
            out << word;
            used += width_of(word);
        }
        first = false;
    }
    out << '\n';
}

/// Three digits and more; "-" for what was not timed.
std::string milliseconds(const Json& time)
{
    if (time.is_null()) return "-";
    const double value = number(time);
    return line("%.*f", value < 10 ? 3 : value < 100 ? 2 : value < 1000 ? 1 : 0, value);
}
std::string milliseconds(const Json* timing)
{
    return timing != nullptr ? milliseconds(timing->at("median")) : "-";
}

const Json* timing_of(const Json& result, int threads)
{
    for (const Json& timing : result.at("timings"))
        if (timing.at("threads") == threads) return &timing;
    return nullptr;
}

bool on_front(const Json& result, int threads)
{
    const Json& front = result.at("pareto");
    return std::find(front.begin(), front.end(), threads) != front.end();
}

/// Kernels by name: whether they estimate what their reference holds.
using Comparable = std::map<std::string, bool>;

void print_head(std::ostream& out, const Json& cell)
{
    std::string text = text_of(cell.at("id")) + ": " + text_of(cell.at("what"));
    text += cell.at("radius").is_null()
                ? "; unlimited radius, "
                : line("; radius %.4g (%.4g x the usual), ", number(cell.at("radius")),
                       number(cell.at("radius_factor")));
    text += line("%.0f triangles", number(cell.at("triangles")));
    if (const double dropped = number(cell.at("dropped_triangles")); dropped > 0)
        text += line(" (%.0f bad ones dropped)", dropped);
    text +=
        line(", %.0f x %.0f%s, %.1f %% background", number(cell.at("width")),
             number(cell.at("height")), cell.at("orthographic").get<bool>() ? " orthographic" : "",
             100 * number(cell.at("background_share")));
    print_wrapped(out, text, 2);
    if (const Json& field = cell.at("height_field"); !field.is_null())
        print_wrapped(out,
                      line("  the depth buffer as the only geometry: %.0f slices, 1 row in %.0f, "
                           "%.2f s, standard error %.4f, RMSE %.4f against the scene",
                           number(field.at("slices")), number(field.at("row_step")),
                           number(field.at("seconds")), number(field.at("standard_error")),
                           number(field.at("error").at("rmse"))),
                      4);
}

void print_reference(std::ostream& out, const Json& reference)
{
    std::string text =
        "  " + text_of(reference.at("meaning")) +
        line(": %.0f directions, %.2f s, standard error %.4f", number(reference.at("directions")),
             number(reference.at("seconds")), number(reference.at("standard_error")));
    const double skipped = number(reference.at("skipped_rays"));
    if (skipped > 0)
        text += line(", %.0f %% of rays left out",
                     100 * skipped / (skipped + number(reference.at("rays"))));
    print_wrapped(out, text, 4);
}

void print_result(std::ostream& out, const Json& result, const Comparable& comparable,
                  const std::vector<int>& threads, std::size_t names)
{
    const auto kernel = comparable.find(text_of(result.at("kernel")));
    out << ' ' << (on_front(result, 1) ? '*' : ' ')
        << (result.at("default").get<bool>() ? 'd' : ' ')
        << (kernel != comparable.end() && !kernel->second ? '~' : ' ')
        << padded(text_of(result.at("id")), names);
    for (const int count : threads)
        out << line(" %8s", milliseconds(timing_of(result, count)).c_str());
    const Json& error = result.at("error");
    out << line(" %6.4f %6.4f %6.3f %+7.4f %6.3f", number(error.at("rmse")),
                number(error.at("fitted_rmse")), number(error.at("rank_correlation")),
                number(error.at("bias")), number(error.at("ssim")));
    if (const Json& own = result.at("own_error"); !own.is_null())
        out << line(" %7.1e", number(own.at("rmse")));
    out << '\n';
}

/// The results of a cell that are shown under one meaning, the fastest first: those on the front, the
/// library's defaults, and the last of a kernel that has neither.
std::vector<const Json*> shown(const Json& cell, const Json& meaning)
{
    std::vector<const Json*> results;
    const Json* last = nullptr;
    bool any = false;
    const auto end_kernel = [&] {
        if (last != nullptr && !any) results.push_back(last);
        any = false;
    };
    for (const Json& result : cell.at("results")) {
        if (result.at("meaning") != meaning) continue;
        if (last != nullptr && last->at("kernel") != result.at("kernel")) end_kernel();
        last = &result;
        if (!on_front(result, 1) && !result.at("default").get<bool>()) continue;
        results.push_back(&result);
        any = true;
    }
    end_kernel();
    const auto time = [](const Json* result) {
        const Json* timing = timing_of(*result, 1);
        return timing != nullptr ? number(timing->at("median")) : HUGE_VAL;
    };
    std::stable_sort(results.begin(), results.end(),
                     [&](const Json* a, const Json* b) { return time(a) < time(b); });
    return results;
}

/// One and the most.
std::vector<int> threads_of(const Json& cell)
{
    int most = 1;
    for (const Json& result : cell.at("results"))
        for (const Json& timing : result.at("timings"))
            most = (std::max)(most, timing.at("threads").get<int>());
    return most > 1 ? std::vector<int>{1, most} : std::vector<int>{1};
}

double share(double part, double rest) { return part > 0 ? 100 * part / (part + rest) : 0; }

/// The result that does the same and leaves nothing out; null for none.
const Json* without_of(const Json& cell, const Json& result)
{
    for (const Json& other : cell.at("results"))
        if (other.at("id") == result.at("without")) return &other;
    return nullptr;
}

/// It left something out that it alone can tell, whether or not another result did without.
bool leaves_out(const Json& result)
{
    const Json& work = result.at("work");
    return number(work.at("skipped")) + number(work.at("skipped_samples")) +
               number(work.at("skipped_passes")) >
           0;
}

/// What planning costs where it finds nothing to leave out, with one thread: a line, or nothing.
void print_planning(std::ostream& out, const Json& cell)
{
    std::string cost;
    for (const Json& result : cell.at("results")) {
        const Json *const twin = without_of(cell, result), *const timing = timing_of(result, 1);
        const Json& plan = result.at("plan");
        if (twin == nullptr || timing == nullptr || timing_of(*twin, 1) == nullptr ||
            plan.is_null() || plan.at("tolerance") != 0 || timing->at("plan").is_null())
            continue;
        const double before = number(timing_of(*twin, 1)->at("median"));
        if (!(before > 0)) continue;
        cost += (cost.empty() ? "" : ", ") +
                line("%.1f %% of ", 100 * number(timing->at("plan")) / before) +
                text_of(twin->at("id"));
    }
    if (!cost.empty())
        print_wrapped(out, "    planning where nothing is left out costs " + cost, 6);
}

/// What results left out, with one thread: those that another one is without, and of the others the
/// library's defaults that left something out by themselves.
void print_left_out(std::ostream& out, const Json& cell)
{
    std::vector<std::pair<const Json*, const Json*>> rows;
    std::size_t names = 0;
    for (const Json& result : cell.at("results")) {
        if (timing_of(result, 1) == nullptr) continue;
        const Json* const twin = without_of(cell, result);
        if (twin == nullptr && !(result.at("default").get<bool>() && leaves_out(result))) continue;
        rows.emplace_back(&result, twin);
        names = (std::max)(names, text_of(result.at("id")).size());
    }
    if (rows.empty()) return;
    out << "  " << padded("left out", names + 2)
        << "  ms/1th   plan with all     x   px % work%   +RMSE largest changed\n";
    for (const auto& [result, twin] : rows) {
        const Json &timing = *timing_of(*result, 1), &work = result->at("work");
        const double skipped = number(work.at("skipped"));
        const double surface = number(work.at("pixels")) - number(work.at("background"));
        const double samples =
            share(number(work.at("skipped_samples")), number(work.at("samples")));
        const double rays = share(number(work.at("skipped_rays")), number(work.at("rays")));
        const double ratio = timing.at("ratio").is_null() ? 0 : number(timing.at("ratio"));
        out << "    " << padded(text_of(result->at("id")), names)
            << line(" %7s", milliseconds(&timing).c_str())
            << line(" %6s", milliseconds(timing.at("plan")).c_str())
            << line(" %7s", milliseconds(twin != nullptr ? timing_of(*twin, 1) : nullptr).c_str())
            << (ratio > 0 ? line(" %5.2f", 1 / ratio) : line(" %5s", "-"))
            << line(" %5.1f %5.1f", share(skipped, surface - skipped), (std::max)(samples, rays));
        if (const Json& added = result->at("added_error"); !added.is_null())
            out << line(" %7.5f %7.5f %7.0f", number(added.at("rmse")), number(added.at("max")),
                        number(added.at("changed")));
        out << '\n';
    }
    print_planning(out, cell);
}

void print_cell(std::ostream& out, const Json& cell, const Comparable& comparable)
{
    print_head(out, cell);
    const std::vector<int> threads = threads_of(cell);
    for (const Json& reference : cell.at("references")) {
        const std::vector<const Json*> results = shown(cell, reference.at("meaning"));
        print_reference(out, reference);
        if (results.empty()) continue;
        std::size_t names = 24;
        for (const Json* result : results)
            names = (std::max)(names, text_of(result->at("id")).size());
        out << "    " << padded("kernel and setting", names);
        for (const int count : threads)
            out << line(" %8s", ("ms/" + std::to_string(count) + "th").c_str());
        out << "   RMSE fitted   rank    bias   SSIM     own\n";
        for (const Json* result : results) print_result(out, *result, comparable, threads, names);
    }
    print_left_out(out, cell);
    out << '\n';
}

constexpr double bounds[] = {0.1, 0.05, 0.02};

/// Nothing is won where there is only sky.
bool has_surface(const Json& cell)
{
    const Json& results = cell.at("results");
    return std::any_of(results.begin(), results.end(), [](const Json& result) {
        return result.at("error").at("pixels").get<double>() > 0;
    });
}

/// The fastest estimate of visibility with one thread and at most that error; none: null. At equal times
/// the closer one.
const Json* winner(const Json& cell, const char* measure, double bound)
{
    const Json* best = nullptr;
    std::pair<double, double> least{};
    for (const Json& result : cell.at("results")) {
        const Json* timing = timing_of(result, 1);
        if (timing == nullptr || result.at("meaning") != "visibility" ||
            result.at("slow").get<bool>() || result.at("row_step").get<int>() > 1)
            continue;
        const std::pair at{number(timing->at("median")), number(result.at("error").at(measure))};
        if (at.second > bound || (best != nullptr && !(at < least))) continue;
        best = &result;
        least = at;
    }
    return best;
}

void print_winners_by_cell(std::ostream& out, const Json& report)
{
    std::vector<std::vector<std::string>> rows{{"cell"}};
    for (const double bound : bounds) rows.front().push_back(line("RMSE <= %g", bound));
    for (const Json& cell : report.at("cells")) {
        if (!has_surface(cell)) continue;
        rows.push_back({text_of(cell.at("id"))});
        for (const double bound : bounds) {
            const Json* best = winner(cell, "rmse", bound);
            rows.back().push_back(best != nullptr ? text_of(best->at("id")) : "-");
        }
    }
    std::vector<std::size_t> widths(rows.front().size());
    for (const auto& row : rows)
        for (std::size_t i = 0; i < row.size(); ++i)
            widths[i] = (std::max)(widths[i], row[i].size());
    for (const auto& row : rows) {
        std::string text;
        for (std::size_t i = 0; i < row.size(); ++i)
            text += "  " + (i + 1 < row.size() ? padded(row[i], widths[i]) : row[i]);
        out << text << '\n';
    }
}

/// Which kernel wins how many cells, with whatever setting.
void print_winners_by_kernel(std::ostream& out, const Json& report, const char* measure,
                             const char* name)
{
    for (const double bound : bounds) {
        std::map<std::string, int> counts;
        int none = 0;
        for (const Json& cell : report.at("cells")) {
            if (!has_surface(cell)) continue;
            const Json* best = winner(cell, measure, bound);
            if (best != nullptr) ++counts[text_of(best->at("kernel"))];
            else ++none;
        }
        std::vector<std::pair<std::string, int>> list{counts.begin(), counts.end()};
        std::stable_sort(list.begin(), list.end(),
                         [](const auto& a, const auto& b) { return a.second > b.second; });
        if (none > 0) list.emplace_back("none", none);
        std::string text = line("  %s <= %g:", name, bound);
        for (const auto& [kernel, count] : list)
            text += (text.ends_with(':') ? " " : ", ") + kernel + ' ' + std::to_string(count);
        print_wrapped(out, text, 4);
    }
}

}  // namespace

void print_table(std::ostream& out, const Json& report)
{
    Comparable comparable;
    for (const Json& kernel : report.at("kernels"))
        comparable[text_of(kernel.at("name"))] = kernel.at("comparable").get<bool>();
    for (const Json& cell : report.at("cells")) print_cell(out, cell, comparable);

    out << "*  no other result of its meaning is as fast with one thread and as close to the "
           "scene\n"
           "d  the library's defaults\n"
           "~  estimates something else than the reference holds: fitted and rank say more than "
           "RMSE\n"
           "fitted: RMSE after the best monotone function of the value; rank: Spearman's "
           "correlation;\n"
           "own: RMSE against the kernel's own formula, computed the slow way\n"
           "left out: against the same kernel with everything; x: how many times as fast, plan "
           "included;\n"
           "  pixels: share of the surface; work: share of the samples or rays of the rest;\n"
           "  changed: pixels of which any bit differs\n\n"
           "The fastest estimate of visibility with one thread, of those close enough to the "
           "scene:\n";
    print_winners_by_cell(out, report);
    out << "Cells that a kernel wins:\n";
    print_winners_by_kernel(out, report, "rmse", "RMSE");
    print_winners_by_kernel(out, report, "fitted_rmse", "fitted");
}

}  // namespace report
