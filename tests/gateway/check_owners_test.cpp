// Who has the ports of a model: modules of an application, and entries of mappings.
#include "gateway/mapping/check_owners.hpp"

#include <gmock/gmock.h>

#include <string>

#include "rules/model/application_reader.hpp"
#include "tests/gateway/check_scene.hpp"

namespace arbiter::gateway {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// Who has the ports of kModel, beside an application with these modules. Warnings alone.
Read owners(const std::string& mapping, const std::string& modules) {
  Read read = read_text(mapping);
  EXPECT_THAT(read.findings(), IsEmpty());
  rules::Diagnostics ignored;
  rules::ModelTexts texts;
  texts.models.push_back({"model.xml", kModel});
  const rules::RuleSet rules = rules::load(std::move(texts), ignored);
  const rules::TextFile file("app.xml", "<application>\n" + modules + "</application>");
  const rules::Application application = rules::read_application(file, read.diagnostics);
  check_owners({read.mapping}, rules, application, read.diagnostics);
  return read;
}

std::string module_called(const std::string& name, const std::string& more = "") {
  return "<module><name>" + name + "</name>" + more + "</module>\n";
}

TEST(CheckOwners, EachPortHasOneOfAModuleAndAMapping) {
  const std::string nav = dds(in("/nav", "/Nav/cmd:o"));
  EXPECT_THAT(owners(nav, module_called("/Base")).findings(), IsEmpty());
  EXPECT_THAT(owners(nav, "").findings(), IsEmpty()) << "no modules: nothing is known";
}

TEST(CheckOwners, APortThatNobodyHasIsFound) {
  const Read read = owners(dds(in("/nav", "/Nav/cmd:o")), module_called("/Other"));
  ASSERT_THAT(read.findings(), ElementsAre(HasSubstr("warning no-owner")));
  EXPECT_THAT(read.message(), HasSubstr("/Base/cmd:i is in no mapping and belongs to no module"));
  EXPECT_THAT(owners(dds(in("/nav", "/Nav/cmmd:o")), module_called("/Base")).message(),
              HasSubstr("nobody publishes there; did you mean \"/Nav/cmmd:o\"?"));
}

// No application says whether a component has it.
TEST(CheckTakers, AnInputPortThatNoEntryTakesFromIsNoted) {
  rules::Diagnostics ignored;
  rules::ModelTexts texts;
  texts.models.push_back({"model.xml", kModel});
  const rules::RuleSet rules = rules::load(std::move(texts), ignored);
  Read without = read_text(dds(in("/nav", "/Nav/cmd:o")));
  check_takers({without.mapping}, rules, without.diagnostics);
  ASSERT_THAT(without.findings(), ElementsAre(HasSubstr("note no-taker")));
  EXPECT_THAT(without.message(), HasSubstr("no mapping takes what /Base/cmd:i gets"));
  Read with = read_text(dds(in("/nav", "/Nav/cmd:o") + out("/cmd", "/Base/cmd:i")));
  check_takers({with.mapping}, rules, with.diagnostics);
  EXPECT_THAT(with.findings(), IsEmpty());
}

TEST(CheckOwners, APortThatTwoHaveIsFound) {
  const std::string both = dds(in("/nav", "/Nav/cmd:o") + out("/cmd", "/Base/cmd:i"));
  const Read read = owners(both, module_called("/Nav"));
  ASSERT_THAT(read.findings(), ElementsAre("1:76 warning two-owners"));
  EXPECT_THAT(read.message(), HasSubstr("the module \"/Nav\" (app.xml:2:1) as well"));
  const std::string twins = module_called("/Base") + module_called("/Base");
  EXPECT_THAT(owners(dds(in("/nav", "/Nav/cmd:o")), twins).findings(),
              ElementsAre(HasSubstr("warning two-owners")));
  const std::string elsewhere =
      module_called("/Base", "<node>one</node>") + module_called("/Base", "<node>other</node>");
  EXPECT_THAT(owners(dds(in("/nav", "/Nav/cmd:o")), elsewhere).findings(), IsEmpty());
}

TEST(CheckOwners, AModuleMayStandForTheGateway) {
  const std::string both = dds(in("/nav", "/Nav/cmd:o") + out("/cmd", "/Base/cmd:i"));
  EXPECT_THAT(
      owners(both, module_called("arbiter-gateway-dds", "<prefix>/Nav</prefix>")).findings(),
      IsEmpty());
}

}  // namespace
}  // namespace arbiter::gateway
