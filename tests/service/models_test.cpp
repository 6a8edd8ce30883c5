// What a daemon keeps of models: their names and files, what waits to be changed, what was.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "service/models/arguments.hpp"
#include "service/models/change_queue.hpp"
#include "service/models/history.hpp"

namespace arbiter::service {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

// What is thrown.
template <class Act>
std::string refusal_of(Act act) {
  try {
    act();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no error";
}

// What naming them so throws.
std::string refusal_of_files(const std::vector<std::string>& models,
                             const std::vector<std::string>& applications) {
  return refusal_of([&] { return named_files(models, applications); });
}

TEST(ModelFiles, WithoutANameFormTheDefaultModel) {
  const auto named = named_files({"a.xml", "dir/b=c.xml", "./x=y.xml"}, {});
  ASSERT_EQ(named.size(), 1u);
  EXPECT_EQ(named[0].name, "default");
  EXPECT_THAT(named[0].files.models, ElementsAre("a.xml", "dir/b=c.xml", "./x=y.xml"));
  EXPECT_EQ(named[0].files.application, std::nullopt);
  EXPECT_TRUE(named_files({}, {}).empty());
}

TEST(ModelFiles, OfOneNameFormOneModelInTheOrderOfTheFirst) {
  const auto named = named_files({"b=1.xml", "a=2.xml", "b=3.xml"}, {"all.xml", "a=own.xml"});
  ASSERT_EQ(named.size(), 2u);
  EXPECT_EQ(named[0].name, "b");
  EXPECT_THAT(named[0].files.models, ElementsAre("1.xml", "3.xml"));
  EXPECT_EQ(named[0].files.application, "all.xml");
  EXPECT_EQ(named[1].name, "a");
  EXPECT_EQ(named[1].files.application, "own.xml");
}

TEST(ModelFiles, AnApplicationAloneIsAModelToo) {
  const auto named = named_files({}, {"application.xml"});
  ASSERT_EQ(named.size(), 1u);
  EXPECT_EQ(named[0].files.application, "application.xml");
}

TEST(ModelFiles, SayWhatIsWrong) {
  EXPECT_THAT(refusal_of_files({"a="}, {}), HasSubstr("\"a=\" names no file"));
  EXPECT_THAT(refusal_of_files({"a b=two.xml"}, {}),
              AllOf(HasSubstr("\"a b\" is no name for a model"), HasSubstr("./a b=two.xml")));
  EXPECT_THAT(refusal_of_files({"a.xml"}, {"=b.xml"}), HasSubstr("\"\" is no name for a model"));
  EXPECT_THAT(refusal_of_files({"a=x"}, {"b=y"}), HasSubstr("there is no model \"b\""));
  EXPECT_THAT(refusal_of_files({"x"}, {"y", "z"}), HasSubstr("two applications"));
  EXPECT_THAT(refusal_of_files({"a=x"}, {"a=y", "a=z"}), HasSubstr("two applications"));
  std::vector<std::string> many;
  for (std::size_t i = 0; i <= kMaxModels; ++i) many.push_back("m" + std::to_string(i) + "=x");
  EXPECT_THAT(refusal_of_files(many, {}), HasSubstr("there are 65 models"));
}

TEST(ModelFiles, NamesArePlain) {
  for (const char* name : {"a", "Search_and-Track.2", "9"})
    EXPECT_TRUE(is_model_name(name)) << name;
  for (const char* name : {"", "-a", "a b", "a/b", "ä", "a="}) {
    EXPECT_FALSE(is_model_name(name)) << name;
  }
  EXPECT_TRUE(is_model_name(std::string(kMaxModelName, 'x')));
  EXPECT_FALSE(is_model_name(std::string(kMaxModelName + 1, 'x')));
}

Change reload_for(ClientId client) { return {Change::Kind::kReload, {}, 0, "", {{client, 1}}}; }
Change switch_for(ClientId client, const std::string& name) {
  return {Change::Kind::kSwitch, name, 0, "", {{client, 1}}};
}

TEST(Changes, ThatAreTheSameAndStandBehindEachOtherAreOne) {
  ChangeQueue changes;
  for (const ClientId client : {ClientId{1}, ClientId{2}}) changes.add(reload_for(client));
  for (const ClientId client : {ClientId{3}, ClientId{4}}) changes.add(switch_for(client, "a"));
  changes.add(switch_for(5, "b"));
  changes.add(reload_for(6));
  std::vector<std::size_t> asking;
  for (; !changes.empty();) asking.push_back(changes.take_next().asking.size());
  EXPECT_THAT(asking, ElementsAre(2, 2, 1, 1));
}

TEST(Changes, RollbacksCountEachForItself) {
  ChangeQueue changes;
  for (int i = 0; i < 2; ++i) changes.add({Change::Kind::kRollback, {}, 0, "", {{1, 1}}});
  changes.take_next();
  EXPECT_FALSE(changes.empty());
}

TEST(Changes, AreBounded) {
  ChangeQueue changes;
  for (std::size_t i = 0; i < ChangeQueue::kMaxWaiting; ++i) {
    changes.add(switch_for(i, i % 2 == 0 ? "a" : "b"));
  }
  EXPECT_THAT(refusal_of([&] { changes.add(switch_for(1, "a")); }),
              HasSubstr("limit-exceeded: 64"));
  changes.add(switch_for(1, "b"));  // joins the last
  changes.add({Change::Kind::kReload, {}, 0, "a signal", {}});
  changes.add({Change::Kind::kReload, {}, 0, "a signal", {}});
  std::size_t count = 0;
  for (; !changes.empty(); ++count) changes.take_next();
  EXPECT_EQ(count, ChangeQueue::kMaxWaiting + 1) << "a signal cannot be refused";
}

TEST(Changes, OfOneClientAreBounded) {
  ChangeQueue changes;
  for (std::uint32_t i = 0; i < shm::kMaxPostponed; ++i) changes.add(reload_for(1));
  EXPECT_THAT(refusal_of([&] { changes.add(reload_for(1)); }), HasSubstr("kMaxPostponed"));
  changes.add(reload_for(2));
}

ModelPointer model_of(std::size_t size) {
  auto model = std::make_shared<Model>();
  model->name = "m";
  model->compiled.sources.resize(size / sizeof(std::string));
  return model;
}
PastModel past(std::uint64_t generation, std::uint64_t content = 0,
               ModelPointer model = model_of(0)) {
  PastModel result;
  result.generation = generation;
  result.content = content;
  result.model = std::move(model);
  return result;
}

TEST(History, ARollbackGoesToTheOneBeforeAndThenFurtherBack) {
  History history;
  EXPECT_EQ(history.previous(), nullptr);
  history.add(past(1));
  EXPECT_EQ(history.previous(), nullptr);
  history.add(past(2));
  history.add(past(3));
  ASSERT_EQ(history.previous()->generation, 2u);
  history.add(past(4, 2));  // the rollback itself
  ASSERT_EQ(history.previous()->generation, 1u);
  history.add(past(5, 1));
  EXPECT_EQ(history.previous(), nullptr) << "there was nothing before";
  history.add(past(6));
  ASSERT_EQ(history.previous()->generation, 5u);
  EXPECT_EQ(history.previous()->content, 1u);
}

TEST(History, AReloadThatChangedNothingIsNoStep) {
  History history;
  history.add(past(1));
  history.add(past(2));
  history.add(past(3, 2));
  EXPECT_EQ(history.previous()->generation, 1u);
}

TEST(History, KeepsTheLast) {
  History history;
  for (std::uint64_t i = 1; i <= History::kMaxEntries + 3; ++i) history.add(past(i));
  EXPECT_EQ(history.find(3), nullptr);
  EXPECT_NE(history.find(4), nullptr);
  EXPECT_EQ(history.status().size(), History::kMaxEntries);
  EXPECT_EQ(history.status()[0].generation, History::kMaxEntries + 3);
}

TEST(History, KeepsModelsWithinItsBound) {
  History history(10'000);
  const auto shared = model_of(4'000);
  history.add(past(1, 0, model_of(4'000)));
  history.add(past(2, 0, shared));
  EXPECT_NE(history.find(1)->model, nullptr);
  history.add(past(3, 0, shared));
  EXPECT_NE(history.find(1)->model, nullptr) << "one that stands there twice costs once";
  history.add(past(4, 0, model_of(4'000)));
  EXPECT_EQ(history.find(1)->model, nullptr);
  EXPECT_NE(history.find(2)->model, nullptr);
  history.add(past(5, 0, model_of(40'000)));
  EXPECT_NE(history.find(5)->model, nullptr) << "the one in force is kept whatever it takes";
  EXPECT_EQ(history.find(4)->model, nullptr);
  EXPECT_FALSE(history.status()[4].is_kept);
}

}  // namespace
}  // namespace arbiter::service
