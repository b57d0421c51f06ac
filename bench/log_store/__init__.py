"""Log store: copies of the logs on any file system or object store that fsspec reads, such as S3."""

from bench.log_store.address import STORE_FILE, check_store_url, find_store, keep_store_url
from bench.log_store.copier import CopyCounts, LogCopier
from bench.log_store.copying import check_object, copy_log, make_object_url
from bench.log_store.errors import LogStoreError, LogStoreUnavailableError
from bench.log_store.local_logs import LocalLogs
from bench.log_store.objects import hash_object

__all__ = [
    "STORE_FILE",
    "CopyCounts",
    "LocalLogs",
    "LogCopier",
    "LogStoreError",
    "LogStoreUnavailableError",
    "check_object",
    "check_store_url",
    "copy_log",
    "find_store",
    "hash_object",
    "keep_store_url",
    "make_object_url",
]
