"""The ROS 2 types that VRG speaks: their fields, in the words of `.msg` files, and the hashes of those that travel.

The definitions are those of Jazzy, which newer distributions keep (common_interfaces, rcl_interfaces, geometry2; BSD
and Apache-2.0). A hash is that of REP 2016: SHA-256 over the canonical JSON of the type with all that it is made of.
"""

from typing import Final

FIELDS: Final[dict[str, dict[str, str]]] = {
    "builtin_interfaces/Duration": {
        "sec": "int32",
        "nanosec": "uint32",
    },
    "builtin_interfaces/Time": {
        "sec": "int32",
        "nanosec": "uint32",
    },
    "geometry_msgs/Point": {
        "x": "float64",
        "y": "float64",
        "z": "float64",
    },
    "geometry_msgs/Pose": {
        "position": "geometry_msgs/Point",
        "orientation": "geometry_msgs/Quaternion",
    },
    "geometry_msgs/PoseStamped": {
        "header": "std_msgs/Header",
        "pose": "geometry_msgs/Pose",
    },
    "geometry_msgs/PoseWithCovariance": {
        "pose": "geometry_msgs/Pose",
        "covariance": "float64[36]",
    },
    "geometry_msgs/Quaternion": {
        "x": "float64",
        "y": "float64",
        "z": "float64",
        "w": "float64",
    },
    "geometry_msgs/Transform": {
        "translation": "geometry_msgs/Vector3",
        "rotation": "geometry_msgs/Quaternion",
    },
    "geometry_msgs/TransformStamped": {
        "header": "std_msgs/Header",
        "child_frame_id": "string",
        "transform": "geometry_msgs/Transform",
    },
    "geometry_msgs/Twist": {
        "linear": "geometry_msgs/Vector3",
        "angular": "geometry_msgs/Vector3",
    },
    "geometry_msgs/TwistStamped": {
        "header": "std_msgs/Header",
        "twist": "geometry_msgs/Twist",
    },
    "geometry_msgs/TwistWithCovariance": {
        "twist": "geometry_msgs/Twist",
        "covariance": "float64[36]",
    },
    "geometry_msgs/Vector3": {
        "x": "float64",
        "y": "float64",
        "z": "float64",
    },
    "nav_msgs/MapMetaData": {
        "map_load_time": "builtin_interfaces/Time",
        "resolution": "float32",
        "width": "uint32",
        "height": "uint32",
        "origin": "geometry_msgs/Pose",
    },
    "nav_msgs/OccupancyGrid": {
        "header": "std_msgs/Header",
        "info": "nav_msgs/MapMetaData",
        "data": "int8[]",
    },
    "nav_msgs/Odometry": {
        "header": "std_msgs/Header",
        "child_frame_id": "string",
        "pose": "geometry_msgs/PoseWithCovariance",
        "twist": "geometry_msgs/TwistWithCovariance",
    },
    "rosgraph_msgs/Clock": {
        "clock": "builtin_interfaces/Time",
    },
    "sensor_msgs/BatteryState": {
        "header": "std_msgs/Header",
        "voltage": "float32",
        "temperature": "float32",
        "current": "float32",
        "charge": "float32",
        "capacity": "float32",
        "design_capacity": "float32",
        "percentage": "float32",
        "power_supply_status": "uint8",
        "power_supply_health": "uint8",
        "power_supply_technology": "uint8",
        "present": "bool",
        "cell_voltage": "float32[]",
        "cell_temperature": "float32[]",
        "location": "string",
        "serial_number": "string",
    },
    "sensor_msgs/CompressedImage": {
        "header": "std_msgs/Header",
        "format": "string",
        "data": "uint8[]",
    },
    "sensor_msgs/LaserScan": {
        "header": "std_msgs/Header",
        "angle_min": "float32",
        "angle_max": "float32",
        "angle_increment": "float32",
        "time_increment": "float32",
        "scan_time": "float32",
        "range_min": "float32",
        "range_max": "float32",
        "ranges": "float32[]",
        "intensities": "float32[]",
    },
    "sensor_msgs/NavSatFix": {
        "header": "std_msgs/Header",
        "status": "sensor_msgs/NavSatStatus",
        "latitude": "float64",
        "longitude": "float64",
        "altitude": "float64",
        "position_covariance": "float64[9]",
        "position_covariance_type": "uint8",
    },
    "sensor_msgs/NavSatStatus": {
        "status": "int8",
        "service": "uint16",
    },
    "sensor_msgs/Range": {
        "header": "std_msgs/Header",
        "radiation_type": "uint8",
        "field_of_view": "float32",
        "min_range": "float32",
        "max_range": "float32",
        "range": "float32",
        "variance": "float32",
    },
    "std_msgs/ColorRGBA": {
        "r": "float32",
        "g": "float32",
        "b": "float32",
        "a": "float32",
    },
    "std_msgs/Header": {
        "stamp": "builtin_interfaces/Time",
        "frame_id": "string",
    },
    "std_msgs/String": {
        "data": "string",
    },
    "tf2_msgs/TFMessage": {
        "transforms": "geometry_msgs/TransformStamped[]",
    },
    "visualization_msgs/Marker": {
        "header": "std_msgs/Header",
        "ns": "string",
        "id": "int32",
        "type": "int32",
        "action": "int32",
        "pose": "geometry_msgs/Pose",
        "scale": "geometry_msgs/Vector3",
        "color": "std_msgs/ColorRGBA",
        "lifetime": "builtin_interfaces/Duration",
        "frame_locked": "bool",
        "points": "geometry_msgs/Point[]",
        "colors": "std_msgs/ColorRGBA[]",
        "texture_resource": "string",
        "texture": "sensor_msgs/CompressedImage",
        "uv_coordinates": "visualization_msgs/UVCoordinate[]",
        "text": "string",
        "mesh_resource": "string",
        "mesh_file": "visualization_msgs/MeshFile",
        "mesh_use_embedded_materials": "bool",
    },
    "visualization_msgs/MarkerArray": {
        "markers": "visualization_msgs/Marker[]",
    },
    "visualization_msgs/MeshFile": {
        "filename": "string",
        "data": "uint8[]",
    },
    "visualization_msgs/UVCoordinate": {
        "u": "float32",
        "v": "float32",
    },
}
"""The fields of each type in their order: the type of each by its name. `x[]` is a sequence, `x[9]` an array."""

HASHES: Final[dict[str, str]] = {
    "geometry_msgs/PoseStamped": "10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8",
    "geometry_msgs/Twist": "9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
    "geometry_msgs/TwistStamped": "5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64",
    "nav_msgs/OccupancyGrid": "8d348150c12913a31ee0ec170fbf25089e4745d17035792a1ba94d6f0bc0cfc7",
    "nav_msgs/Odometry": "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    "rosgraph_msgs/Clock": "692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564",
    "sensor_msgs/BatteryState": "4bee5dfce981c98faa6828b868307a0a73f992ed0789f374ee96c8f840e69741",
    "sensor_msgs/LaserScan": "64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828",
    "sensor_msgs/NavSatFix": "62223ab3fe210a15976021da7afddc9e200dc9ec75231c1b6a557fc598a65404",
    "sensor_msgs/Range": "b42b62562e93cbfe9d42b82fe5994dfa3d63d7d5c90a317981703f7388adff3a",
    "std_msgs/String": "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
    "tf2_msgs/TFMessage": "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    "visualization_msgs/MarkerArray": "86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf",
}
"""The hash of each type that travels as a message, without its beginning, RIHS_PREFIX."""

RIHS_PREFIX: Final = "RIHS01_"
