"""Live streams: what arrives message by message, decoded, guarded, corrected and filtered.

Free of ROS: nodes connect these to topics, tests and benches to whatever they like.
"""
