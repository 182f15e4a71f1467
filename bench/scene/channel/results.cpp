#include "results.hpp"

#include <cmath>
#include <cstdio>

#include "compare/json.hpp"
#include "compare/table.hpp"
#include "kernels.hpp"

namespace compare {

namespace {

Json machine(const Options& options)
{
    Json json =
        json_of_machine(targets().best().name, "threads", std::to_string(options.threads), options);
    return json;
}

std::string megabytes(std::size_t bytes) { return digits("%.1f MB", 1e-6 * double(bytes)); }

}  // namespace

Measurement measured(const char* part, const Subject& subject, const Options& options,
                     int resolution)
{
    Measurement m;
    m.part = part;
    m.subject = subject.mesh.name;
    m.triangles = subject.mesh.triangles();
    m.views = subject.views.size();
    m.resolution = resolution;
    m.threads = options.threads;
    m.picture_bytes = targets().best().picture_size(resolution, options.threads);
    return m;
}

double per_polygon(const Measurement& m, std::size_t bytes)
{
    const double beside = bytes > m.picture_bytes ? double(bytes - m.picture_bytes) : 0;
    return m.triangles > 0 ? beside / double(m.triangles) : 0;
}

bool as_agreed(const Subject& subject, const Options& options)
{
    return std::fabs(double(subject.mesh.triangles()) - 1e6) < 5e4 && subject.views.size() == 642 &&
           options.threads == 2;
}

Mark mark_of(std::string what, const Summary& value, double target, double stretch,
             const std::string& where)
{
    Mark mark;
    mark.what = std::move(what);
    mark.target = target;
    mark.stretch = stretch;
    mark.take(value, where);
    return mark;
}

void print_measurement(const Measurement& m)
{
    const auto line = [](const std::string& what, const std::string& value) {
        std::printf("  %-52s %s\n", what.c_str(), value.c_str());
    };
    const double pairs = double(m.triangles) * double(m.views);
    std::printf("%s: %s, %zu triangles, %zu views, %d x %d, %d threads\n", m.part.c_str(),
                m.subject.c_str(), m.triangles, m.views, m.resolution, m.resolution, m.threads);
    line("seconds", digits("%.2f", m.seconds.median));
    line("seconds of the processor, all threads", digits("%.2f", m.processor_seconds));
    line("milliseconds per view", digits("%.2f", 1e3 * m.seconds.median / double(m.views)));
    line("million triangles x views per second", digits("%.1f", 1e-6 * pairs / m.seconds.median));
    if (m.bytes > 0) {
        line("memory asked for", megabytes(m.bytes));
        line("bytes per polygon beside mesh and picture", digits("%.1f", per_polygon(m, m.bytes)));
    }
    if (m.resident) {
        line("growth of resident memory", megabytes(*m.resident));
        line("of it per polygon beside the picture", digits("%.1f", per_polygon(m, *m.resident)));
    }
    for (const Fact& fact : m.facts) line(fact.what, digits("%.6g", fact.value));
    std::printf("\n");
    std::fflush(stdout);
}

void print_machine(const Options& options) { print_machine(machine(options)); }

void write_json(const Results& results, const Options& options)
{
    Json json;
    json["machine"] = machine(options);
    json["marks"] = json_of(results.marks);
    json["measurements"] = Json::array();
    for (const Measurement& m : results.measurements) {
        Json entry;
        entry["part"] = m.part;
        entry["subject"] = m.subject;
        entry["triangles"] = m.triangles;
        entry["views"] = m.views;
        entry["resolution"] = m.resolution;
        entry["threads"] = m.threads;
        entry["seconds"] = json_of(m.seconds);
        entry["processor_seconds"] = m.processor_seconds;
        entry["bytes"] = m.bytes;
        entry["picture_bytes"] = m.picture_bytes;
        entry["bytes_per_polygon"] = per_polygon(m, m.bytes);
        entry["resident_bytes"] = m.resident ? Json(*m.resident) : Json{};
        entry["facts"] = json_of(m.facts);
        json["measurements"].push_back(entry);
    }
    write_json(json, options.json);
}

}  // namespace compare
