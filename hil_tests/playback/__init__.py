"""Recorded series, played onto a bus at their own pace."""
