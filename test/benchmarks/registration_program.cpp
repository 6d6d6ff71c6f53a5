// SPDX-License-Identifier: BSD-3-Clause
// PCL's registrations, in a program of their own: PCL is built for another instruction set than
// Berth, and Eigen's types are not the same in both.
//
//   berth-benchmark-pcl CLOUDS GATE... [gicp]
//
// Reads from the file CLOUDS: the model's points and normals, then clouds, each with a first guess
// of T_model_sensor (16 numbers, row by row). ICP with normals pairs points within the first GATE
// (m), and so on from its result with the next; gicp: that method, too, within the first. Prints
// for each cloud and method a line: method, CPU time in ms, the resulting matrix.
#include <pcl/point_types.h>
#include <pcl/registration/gicp.h>
#include <pcl/registration/icp.h>
#include <pcl/search/kdtree.h>

#include <cstdio>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "test/benchmarks/cpu_time.h"

namespace {

using Point = pcl::PointNormal;
using Cloud = pcl::PointCloud<Point>;

constexpr int iterations = 100;
constexpr double stop = 1e-9;  // squared change of the transformation

Cloud::Ptr read_cloud(std::istream& in, std::size_t count, bool normals) {
  Cloud::Ptr cloud(new Cloud);
  cloud->resize(count);
  for (Point& p : *cloud) {
    in >> p.x >> p.y >> p.z;
    if (normals) in >> p.normal_x >> p.normal_y >> p.normal_z;
  }
  return cloud;
}

void print(const char* method, double ms, const Eigen::Matrix4f& result) {
  std::printf("%s %.6f", method, ms);
  for (int i = 0; i < 16; ++i) std::printf(" %.9g", static_cast<double>(result(i / 4, i % 4)));
  std::printf("\n");
}

template <typename Registration>
void prepare(Registration& registration, const Cloud::Ptr& model,
             const pcl::search::KdTree<Point>::Ptr& tree) {
  registration.setInputTarget(model);
  registration.setSearchMethodTarget(tree, true);
  registration.setMaximumIterations(iterations);
  registration.setTransformationEpsilon(stop);
}

/// Normals that look at the sensor, whatever the winding of the faces that they are of.
void turn_to_sensor(Cloud& model, const Eigen::Matrix4f& guess) {
  const Eigen::Vector3f sensor = guess.topRightCorner<3, 1>();
  for (Point& p : model) {
    if (p.getNormalVector3fMap().dot(sensor - p.getVector3fMap()) < 0) {
      p.getNormalVector3fMap() *= -1;
    }
  }
}

template <typename Registration>
void align(const char* method, Registration& registration, const Cloud::Ptr& cloud,
           const std::vector<double>& gates, const Eigen::Matrix4f& guess) {
  Cloud aligned;
  Eigen::Matrix4f pose = guess;
  const double start = berth::benchmark::cpu_ms();
  registration.setInputSource(cloud);
  for (const double gate : gates) {
    registration.setMaxCorrespondenceDistance(gate);
    registration.align(aligned, pose);
    pose = registration.getFinalTransformation();
  }
  print(method, berth::benchmark::cpu_ms() - start, pose);
}

/// As GICP would find them, but from the exact normals: flat across the normal.
pcl::GeneralizedIterativeClosestPoint<Point, Point>::MatricesVectorPtr covariances(
    const Cloud& model) {
  pcl::GeneralizedIterativeClosestPoint<Point, Point>::MatricesVectorPtr all(
      new pcl::GeneralizedIterativeClosestPoint<Point, Point>::MatricesVector);
  constexpr double epsilon = 0.001;  // PCL's own default
  for (const Point& p : model) {
    const Eigen::Vector3d n(p.normal_x, p.normal_y, p.normal_z);
    all->push_back(Eigen::Matrix3d::Identity() - (1 - epsilon) * n * n.transpose());
  }
  return all;
}

}  // namespace

int main(int argc, char* argv[]) {
  std::vector<double> gates;
  bool with_gicp = false;
  for (int i = 2; i < argc; ++i) {
    if (argv[i] == std::string("gicp")) {
      with_gicp = true;
    } else {
      gates.push_back(std::stod(argv[i]));
    }
  }
  if (gates.empty()) return 2;
  std::ifstream in(argv[1]);
  std::string word;
  std::size_t count = 0;
  if (!(in >> word >> count) || word != "model") return 2;
  const Cloud::Ptr model = read_cloud(in, count, true);
  const pcl::search::KdTree<Point>::Ptr tree(new pcl::search::KdTree<Point>);
  tree->setInputCloud(model);
  pcl::IterativeClosestPointWithNormals<Point, Point> icp;
  prepare(icp, model, tree);
  pcl::GeneralizedIterativeClosestPoint<Point, Point> gicp;
  prepare(gicp, model, tree);
  gicp.setTargetCovariances(covariances(*model));
  while (in >> word >> count && word == "cloud") {
    Eigen::Matrix4f guess;
    for (int i = 0; i < 16; ++i) in >> guess(i / 4, i % 4);
    const Cloud::Ptr cloud = read_cloud(in, count, false);
    turn_to_sensor(*model, guess);
    align("icp_with_normals", icp, cloud, gates, guess);
    if (with_gicp) align("gicp", gicp, cloud, {gates.front()}, guess);
    std::fflush(stdout);
  }
  return 0;
}
