# The whole package on ROS 2 Jazzy: docker build -t twbr_estimation . && docker run -it --net=host twbr_estimation
FROM ros:jazzy-ros-base

WORKDIR /robot_ws
COPY . src/twbr_estimation
RUN apt-get update \
    && rosdep update --rosdistro jazzy \
    && PIP_BREAK_SYSTEM_PACKAGES=1 rosdep install --from-paths src --ignore-src -y --rosdistro jazzy \
    && . /opt/ros/jazzy/setup.sh && colcon build \
    && rm -rf /var/lib/apt/lists/*

RUN echo '. /robot_ws/install/setup.sh' >> /etc/bash.bashrc
CMD ["bash"]
