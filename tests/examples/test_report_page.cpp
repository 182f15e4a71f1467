#include <doctest/doctest.h>

#include <cstddef>
#include <filesystem>
#include <random>
#include <string>
#include <string_view>
#include <system_error>

#include "../../examples/report/document.hpp"
#include "../../examples/support/files.hpp"
#include "report_sample.hpp"

namespace {

using report::Json;

/// A folder of its own that goes with the test.
struct Folder {
    std::filesystem::path path = std::filesystem::temp_directory_path() /
                                 ("nook-test-page-" + std::to_string(std::random_device{}()));
    Folder() { std::filesystem::create_directory(path); }
    ~Folder()
    {
        std::error_code ignored;
        std::filesystem::remove_all(path, ignored);
    }
};

std::size_t count(std::string_view text, std::string_view part)
{
    std::size_t found = 0;
    for (std::size_t at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++found;
    return found;
}

/// The JSON of the block with that id.
Json block(const std::string& page, const std::string& id)
{
    const std::string tag = "<script type=\"application/json\" id=\"" + id + "\">";
    const std::size_t begin = page.find(tag);
    REQUIRE_MESSAGE(begin != page.npos, id);
    const std::size_t end = page.find("</script>", begin);
    REQUIRE(end != page.npos);
    return Json::parse(page.substr(begin + tag.size(), end - begin - tag.size()));
}

}  // namespace

TEST_CASE("the page holds the report, whatever its texts are")
{
    Json report = report_sample::good_report();
    const std::string plain = report::page_of(report, "no-such-folder");
    CHECK(block(plain, "report") == report);
    for (const char* mark : {"{{style}}", "{{report}}", "{{pictures}}", "{{script}}"})
        CHECK(plain.find(mark) == plain.npos);

    report["cells"][0]["what"] = "</script><script>alert(1)</script><!-- \"]]> {{script}} é";
    report["run"]["command"] = "nook-report '<a & b>'";
    const std::string page = report::page_of(report, "no-such-folder");
    CHECK(block(page, "report") == report);
    for (const char* tag : {"<script", "</script", "<!--"})
        CHECK(count(page, tag) == count(plain, tag));
}

TEST_CASE("text that is not UTF-8 leaves a page that can be read")
{
    Json report = report_sample::good_report();
    report["cells"][0]["what"] = "a\xff";
    CHECK(block(report::page_of(report, "no-such-folder"), "report")["cells"][0]["what"] ==
          "a\xef\xbf\xbd");
}

TEST_CASE("pictures stand in the page as base64, and missing ones are left out")
{
    Json report = report_sample::good_report();
    Json& cell = report["cells"][0];
    cell["results"].push_back(report_sample::planned(cell["results"][1]));
    cell["results"].push_back(report_sample::planned(cell["results"][2]));
    cell["results"].back()["plan"]["picture"] = nullptr;
    const std::string id = cell["id"], shaded = cell["shaded"], picture = cell["results"][0]["id"];
    const std::string reference = cell["references"][0]["picture"];
    const Folder folder;
    std::filesystem::create_directory(folder.path / id);
    // The vectors of RFC 4648, section 10; the pictures themselves are not looked at.
    support::write_file(folder.path / id / (shaded + ".jpg"), "foobar");
    support::write_file(folder.path / id / (picture + ".jpg"), "fooba");
    support::write_file(folder.path / id / "plan-surface.jpg", "foob");
    support::write_file(folder.path / id / (reference + ".jpg"),
                        std::string_view{"\xff\xfe\x00\xfb", 4});
    const std::string page = report::page_of(report, folder.path);
    const std::string type = "data:image/jpeg;base64,";
    CHECK(block(page, "pictures-shaded") == Json{{id + "/" + shaded, type + "Zm9vYmFy"}});
    CHECK(block(page, "pictures-0") == Json{{id + "/" + reference, type + "//4A+w=="},
                                            {id + "/" + picture, type + "Zm9vYmE="},
                                            {id + "/plan-surface", type + "Zm9vYg=="}});
    for (std::size_t i = 1; i < report["cells"].size(); ++i)
        CHECK(block(page, "pictures-" + std::to_string(i)) == Json::object());
}

TEST_CASE("the page asks for nothing from elsewhere")
{
    const std::string page = report::page_of(report_sample::good_report(), "no-such-folder");
    CHECK(page.find("default-src 'none'") != page.npos);
    // The name of a namespace is no address that anything is asked for.
    CHECK(count(page, "http") ==
          count(page, "http://www.w3.org/2000/svg") + count(page, "http-equiv"));
    CHECK(count(page, " src=") == 0);
    CHECK(count(page, "@import") == 0);
}
