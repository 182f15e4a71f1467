#include "common_options.hpp"

#include <algorithm>
#include <cstdio>

#include <nook/version.hpp>

#include "failure.hpp"

namespace compare {

namespace {

std::string part_of(Arguments& arguments, const CommandLine& line)
{
    const std::string part = arguments.value();
    if (std::find(line.parts.begin(), line.parts.end(), part) != line.parts.end()) return part;
    std::string all;
    for (const char* const name : line.parts) all += (all.empty() ? "" : ", ") + std::string{name};
    throw Failure{arguments.word() + ": '" + part.substr(0, 60) + "' is none of " + all};
}

}  // namespace

bool CommonOptions::runs(const std::string& part) const
{
    return parts.empty() || std::find(parts.begin(), parts.end(), part) != parts.end();
}

bool read_common(int argc, const char* const* argv, const CommandLine& line, CommonOptions& options,
                 const std::function<void(Arguments&)>& other)
{
    bool rounds_given = false;
    for (Arguments arguments{argc, argv}; arguments.next();) {
        const std::string& option = arguments.word();
        if (option == "--help" || option == "-h") {
            arguments.flag();
            std::fputs(line.help, stdout);
            return false;
        } else if (option == "--version") {
            arguments.flag();
            std::printf("nook %s\n", nook::version);
            return false;
        } else if (option == "--quick") {
            arguments.flag();
            options.quick = true;
        } else if (option == "--rounds") {
            options.rounds = arguments.count(1, 10000);
            rounds_given = true;
        } else if (option == "--only") {
            options.parts.push_back(part_of(arguments, line));
        } else if (option == "--json") {
            options.json = arguments.file_to_write();
        } else {
            other(arguments);
        }
    }
    if (!rounds_given) options.rounds = options.quick ? line.quick_rounds : line.rounds;
    return true;
}

}  // namespace compare
