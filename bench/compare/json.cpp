#include "json.hpp"

#include <cstdio>
#include <fstream>

#include <nook/version.hpp>

#include "failure.hpp"
#include "support/machine.hpp"

namespace compare {

Json json_of_machine(const char* instruction_set, const char* peer, const std::string& peer_version,
                     const CommonOptions& options)
{
    Json result;
    result["nook"] = nook::version;
    result["cpu"] = support::cpu_name();
    result["compiler"] = support::compiler_name();
    result["instruction_set"] = instruction_set;
    result[peer] = peer_version.empty() ? "not found" : peer_version;
    result["rounds"] = options.rounds;
    result["quick"] = options.quick;
    return result;
}

Json json_of(const Summary& summary)
{
    return {{"median", summary.median},
            {"lower_quartile", summary.lower},
            {"upper_quartile", summary.upper}};
}

Json json_of(const std::vector<Mark>& marks)
{
    Json result = Json::array();
    for (const Mark& mark : marks) {
        Json entry;
        entry["what"] = mark.what;
        entry["value"] = mark.measured ? json_of(mark.value) : Json{};
        entry["worst_at"] = mark.where;
        if (mark.target > 0) entry[mark.at_least ? "at_least" : "at_most"] = mark.target;
        if (mark.stretch > 0) entry["stretch"] = mark.stretch;
        entry["slack"] = slack;
        entry["verdict"] = text_of(mark.verdict());
        result.push_back(entry);
    }
    return result;
}

Json json_of(const std::vector<Fact>& facts)
{
    Json result = Json::object();
    for (const Fact& fact : facts) result[fact.what] = fact.value;
    return result;
}

void print_machine(const Json& machine)
{
    for (const auto& [key, value] : machine.items()) {
        const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
        std::printf("%s: %s\n", key.c_str(), text.c_str());
    }
    std::printf("times: of the processor; of the wall clock where there are two threads\n\n");
}

void write_json(const Json& json, const std::filesystem::path& file)
{
    std::ofstream stream{file};
    stream << json.dump(2) << '\n';
    if (!stream.flush()) throw Failure{file.string() + ": cannot be written"};
}

}  // namespace compare
